#!/usr/bin/env python3
"""The type hashes of message_kinds.h are those of messages.idl by REP-2011, and those that ROS 2
publishes: so messages.idl has ROS's own types.

    type_hash_test.py
"""

import pathlib
import re
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE / "testing"))

from ros_types import Types  # noqa: E402

# As `ros2 topic info --verbose` and recordings of others show them.
PUBLISHED = {
    "std_msgs/msg/Bool": "feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9",
    "std_msgs/msg/Empty": "20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312",
    "std_msgs/msg/Float32MultiArray":
        "0599f6f85b4bfca379873a0b4375a0aca022156bd2d7021275d116ed1fa8bfe0",
    "geometry_msgs/msg/PointStamped":
        "4c0296af86e01e562e9e0405d138a01537247580076c58ea38d7923ac1045897",
    "geometry_msgs/msg/PoseStamped":
        "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    "geometry_msgs/msg/PoseWithCovarianceStamped":
        "26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e",
    "geometry_msgs/msg/Twist": "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    "geometry_msgs/msg/TwistStamped":
        "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    "nav_msgs/msg/OccupancyGrid":
        "8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7",
    "nav_msgs/msg/Odometry": "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "nav_msgs/msg/Path": "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b",
    "tf2_msgs/msg/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    "diagnostic_msgs/msg/DiagnosticArray":
        "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    "visualization_msgs/msg/MarkerArray":
        "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
    "rmw_dds_common/msg/ParticipantEntitiesInfo":
        "91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e",
}


class TypeHashTest(unittest.TestCase):
    def test_hashes_are_those_of_the_types_and_of_ros(self):
        types = Types(HERE / "messages.idl")
        kinds = re.findall(r'^PHEROMONE_KIND\((\w+), (\w+),\s*"(\w+)"\)',
                           (HERE / "message_kinds.h").read_text(), re.M)
        named = {f"{package}/msg/{name}": given for package, name, given in kinds}
        self.assertEqual(named, PUBLISHED)
        for name, given in named.items():
            self.assertEqual(types.hash(name), "RIHS01_" + given, name)


if __name__ == "__main__":
    unittest.main()
