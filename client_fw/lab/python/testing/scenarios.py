"""Scenarios that tests of pheromone_lab share."""

TRAIL = {"type": 1, "name": "trail", "core_m": 0.1, "sigma_m": 0.4, "tau_s": 0.0, "quantum": 0.125, "maximum": 1.0,
         "directional": True}
MAP = {"map": {"width_m": 10.0, "height_m": 10.0, "cell_m": 0.1}, "antennas": {"bias_m": 0.33}}


def small(*groups, **more):
    return {**MAP, "pheromone": [TRAIL, {**TRAIL, "type": 2, "name": "home"}], "robots": list(groups), **more}


def apart(count, name="ants", y=1.0, **more):
    """So many robots, a metre from each other, that head along +x."""
    return {"name": name, "starts": [[1.0 + i, y, 0.0] for i in range(count)], "radius_m": 0.1, **more}


LIVELY = {
    "run": {"duration_s": 60, "seed": 5}, **MAP,
    "pheromone": [{**TRAIL, "tau_s": 20.0}, {**TRAIL, "type": 2, "name": "home", "tau_s": 40.0}],
    "site": [{"name": "nest", "kind": "nest", "at_m": [2.0, 2.0], "radius_m": 1.0},
             {"name": "food", "kind": "food", "at_m": [6.0, 3.0], "radius_m": 0.7, "amount": 5, "refill_s": 4.0}],
    "wall": [{"name": "gate", "points_m": [[4.0, 0.0], [4.0, 5.0]], "thickness_m": 0.2}],
    "event": [{"at_s": 10.0, "wall": "gate", "open": True}, {"at_s": 30.0, "site": "food", "to_m": [7.0, 7.0]},
              {"at_s": 40.0, "robots": "ants", "fail": 0.2}, {"at_s": 60.0, "robots": "ants", "fail": 1.0}],
    "robots": [{"name": "ants", "behaviour": "forage", "count": 60, "radius_m": 0.1, "slip": 0.05,
                "odometry_noise": 0.02, "fix_period_s": 2.0, "fix_sigma_m": 0.05},
               {"name": "wanderers", "behaviour": "explore", "count": 10, "radius_m": 0.2}]}
