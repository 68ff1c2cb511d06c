#include "server/operators/ctl/cluster/cluster_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "server/config/config.h"

namespace pheromone::ctl {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

const ClusterRandom kRandom = {std::string(64, 'e'), "0badcafe"};

const ClusterPlan& Lab() {
  static const ClusterPlan plan =
      PlanCluster("lab", {"a=10.0.0.1", "b=10.0.0.2", "witness=10.0.0.3"}, {}).value();
  return plan;
}

std::map<std::string, PlannedFile> Made(const ClusterPlan& plan, size_t machine) {
  std::map<std::string, PlannedFile> files;
  for (PlannedFile& file : FilesOf(plan, plan.machines[machine], kRandom)) {
    files[file.name] = std::move(file);
  }
  return files;
}

// As systemd reads an EnvironmentFile whose values need no quotes.
std::map<std::string, std::string> Environment(const std::string& text) {
  std::map<std::string, std::string> variables;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with('#')) {
      variables[line.substr(0, line.find('='))] = line.substr(line.find('=') + 1);
    }
  }
  return variables;
}

std::string Refusal(const std::vector<std::string>& machines,
                    const std::vector<std::string>& witnesses = {},
                    const std::string& name = "lab") {
  const Result<ClusterPlan> plan = PlanCluster(name, machines, witnesses);
  return plan.ok() ? std::string() : std::string(plan.error());
}

TEST(ClusterPlan, TheServersTableIsTheSameOnAllAndAccepted) {
  const std::string text = Made(Lab(), 0)["cluster.toml"].text;
  EXPECT_EQ(Made(Lab(), 1)["cluster.toml"].text, text);
  const auto config = config::ParseConfig(std::string(config::DefaultConfigText()) + text, "made");
  ASSERT_TRUE(config.ok()) << config.error();
  const config::ClusterSettings& cluster = *config.value().cluster;
  EXPECT_EQ(cluster.name, "lab");
  EXPECT_EQ(cluster.engine,
            (std::vector<Endpoint>{{"10.0.0.1", 2379}, {"10.0.0.2", 2379}, {"10.0.0.3", 2379}}));
  ASSERT_EQ(cluster.nodes.size(), 2u);
  EXPECT_EQ(cluster.nodes[0].name, "a");
  EXPECT_EQ(cluster.nodes[0].address, (Endpoint{"10.0.0.1", 8390}));
  EXPECT_EQ(cluster.nodes[1].address, (Endpoint{"10.0.0.2", 8390}));
}

TEST(ClusterPlan, EtcdListensOnItsAddressAndLoopbackOnly) {
  auto etcd = Environment(Made(Lab(), 1)["etcd"].text);
  EXPECT_EQ(etcd["ETCD_NAME"], "b");
  EXPECT_EQ(etcd["ETCD_LISTEN_CLIENT_URLS"], "http://10.0.0.2:2379,http://127.0.0.1:2379");
  EXPECT_EQ(etcd["ETCD_LISTEN_PEER_URLS"], "http://10.0.0.2:2380");
  EXPECT_EQ(etcd["ETCD_INITIAL_CLUSTER"],
            "a=http://10.0.0.1:2380,b=http://10.0.0.2:2380,witness=http://10.0.0.3:2380");
  EXPECT_EQ(etcd["ETCD_INITIAL_CLUSTER_TOKEN"], "lab-0badcafe");
  EXPECT_EQ(etcd["ETCD_PRE_VOTE"], "true");
  EXPECT_EQ(etcd["ETCD_HEARTBEAT_INTERVAL"], "50");
  EXPECT_EQ(etcd["ETCD_ELECTION_TIMEOUT"], "500");
}

TEST(ClusterPlan, AWitnessHasNoServerAndNoSecret) {
  std::vector<std::string> names;
  for (const auto& [name, file] : Made(Lab(), 2)) {
    names.push_back(name);
    EXPECT_THAT(file.text, Not(HasSubstr("8390"))) << name;
    EXPECT_THAT(file.text, Not(HasSubstr(kRandom.secret))) << name;
  }
  EXPECT_THAT(names, UnorderedElementsAre("README.txt", "etcd", "etcd-unit.conf", "firewall.nft"));
}

TEST(ClusterPlan, TheSecretIsInItsFileAndInNoOther) {
  for (const auto& [name, file] : Made(Lab(), 0)) {
    EXPECT_EQ(file.is_secret, name == "cluster-secret");
    EXPECT_EQ(file.text.find(kRandom.secret) != std::string::npos, file.is_secret) << name;
  }
}

TEST(ClusterPlan, InstructionsNameEveryFileOfTheFolder) {
  for (const size_t machine : {0u, 1u, 2u}) {
    auto files = Made(Lab(), machine);
    for (const auto& [name, file] : files) {
      if (name != "README.txt") {
        EXPECT_THAT(files["README.txt"].text, ContainsRegex("[ <]" + name + " ")) << name;
      }
    }
  }
}

TEST(ClusterPlan, InstructionsTellOfAMachineInPlaceOfALostOne) {
  EXPECT_THAT(Made(Lab(), 0)["README.txt"].text,
              HasSubstr("Then its server takes the map from another one"));
  const std::string text = Made(Lab(), 2)["README.txt"].text;
  EXPECT_THAT(text, HasSubstr("join as a new\nmember"));
  EXPECT_THAT(text, HasSubstr("CLUSTER.md on a, b, has"));
  EXPECT_THAT(text, Not(HasSubstr("secret")));
}

TEST(ClusterPlan, OnlyTheOtherMachinesPassTheFirewall) {
  EXPECT_THAT(
      Made(Lab(), 0)["firewall.nft"].text,
      HasSubstr("    ip saddr { 10.0.0.1, 10.0.0.2, 10.0.0.3 } tcp dport { 2379, 2380, 8390 } "
                "accept\n    tcp dport { 2379, 2380, 8390 } drop\n"));
  const std::string text = Made(Lab(), 2)["README.txt"].text;
  EXPECT_THAT(text, HasSubstr("ufw allow proto tcp from 10.0.0.1 to 10.0.0.3 port 2379,2380\n"));
  EXPECT_THAT(text, Not(HasSubstr("from 10.0.0.3")));
}

TEST(ClusterPlan, AddressesMayBeOfVersion6) {
  const ClusterPlan plan =
      PlanCluster("lab", {"a=[fd00::1]", "b=fd00::2", "c=fd00::3"}, {"c"}).value();
  EXPECT_EQ(plan.machines[0].address, "fd00::1");
  EXPECT_TRUE(plan.machines[2].is_witness);
  auto files = Made(plan, 0);
  EXPECT_EQ(Environment(files["etcd"].text)["ETCD_LISTEN_CLIENT_URLS"],
            "http://[fd00::1]:2379,http://[::1]:2379");
  const auto config = config::ParseConfig(
      std::string(config::DefaultConfigText()) + files["cluster.toml"].text, "made");
  ASSERT_TRUE(config.ok()) << config.error();
  EXPECT_EQ(config.value().cluster->engine[2], (Endpoint{"fd00::3", 2379}));
  EXPECT_THAT(files["firewall.nft"].text, HasSubstr("    ip6 saddr { fd00::1, fd00::2, fd00::3 }"));
}

TEST(ClusterPlan, ErrorsNameTheValueAndWhatIsExpected) {
  EXPECT_THAT(Refusal({"a", "b=10.0.0.2", "c=10.0.0.3"}),
              HasSubstr("machine \"a\": expected NAME=ADDRESS"));
  EXPECT_THAT(Refusal({"..=10.0.0.1", "b=10.0.0.2", "c=10.0.0.3"}), HasSubstr("\"..=10.0.0.1\""));
  EXPECT_THAT(Refusal({"a=lab-pc", "b=10.0.0.2", "c=10.0.0.3"}),
              HasSubstr("machine \"a=lab-pc\": expected a numeric address"));
  for (const std::string own : {"127.0.1.1", "0.0.0.0", "::1", "::", "fe80::1"}) {
    EXPECT_THAT(Refusal({"a=" + own, "b=10.0.0.2", "c=10.0.0.3"}), HasSubstr("reach it")) << own;
  }
  EXPECT_THAT(Refusal({"a=10.0.0.1", "a=10.0.0.2", "c=10.0.0.3"}),
              HasSubstr("machine \"a=10.0.0.2\": expected another name than"));
  EXPECT_THAT(Refusal({"a=10.0.0.1", "b=10.0.0.1", "c=10.0.0.3"}), HasSubstr("another address"));
  EXPECT_THAT(Refusal({"a=10.0.0.1", "b=10.0.0.2"}), HasSubstr("2 machines: expected 3, 5"));
  EXPECT_THAT(Refusal({"a=10.0.0.1", "b=10.0.0.2", "c=10.0.0.3", "d=10.0.0.4"}),
              HasSubstr("4 machines: expected"));
  EXPECT_THAT(Refusal({"a=10.0.0.1", "b=10.0.0.2", "c=10.0.0.3"}, {"b", "c"}),
              HasSubstr("1 of 3 machines have a server"));
  EXPECT_THAT(Refusal({"a=10.0.0.1", "b=10.0.0.2", "c=10.0.0.3"}, {"d"}),
              HasSubstr("witness \"d\": expected"));
  EXPECT_THAT(Refusal({"a=10.0.0.1", "b=10.0.0.2", "c=10.0.0.3"}, {}, "the lab"),
              HasSubstr("cluster name \"the lab\": expected"));
}

}  // namespace
}  // namespace pheromone::ctl
