// Nets of the Model Checking Contest, from make_nets.py, and programs that judge ours.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "server/base/file.h"
#include "server/base/testing/temporary_folder.h"
#include "server/core/petri/net.h"
#include "server/formats/nets/pnml.h"

namespace pheromone::nets {

/// What a command of the shell prints; it is expected to succeed.
inline std::string OutputOf(const std::string& command, const TemporaryFolder& folder) {
  const std::string whole = "cd " + folder.string() + " && { " + command + "; } >out.txt 2>&1";
  EXPECT_EQ(std::system(whole.c_str()), 0) << whole;
  return ReadFile(folder / "out.txt").value();
}

/// What make_nets.py prints.
inline std::string MakeNets(const std::string& arguments) {
  const TemporaryFolder folder;
  return OutputOf("python3 " PHEROMONE_SOURCE_DIR "/proto_tests/petri/make_nets.py " + arguments,
                  folder);
}

inline petri::Net ContestNet(const std::string& name, int size) {
  const std::string title = name + " " + std::to_string(size);
  Result<petri::Net> net = ParsePnml(title, MakeNets(title));
  EXPECT_TRUE(net.ok()) << net.error();
  return net.ok() ? std::move(net).value() : petri::Net{};
}

}  // namespace pheromone::nets
