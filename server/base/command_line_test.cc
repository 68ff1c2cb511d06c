#include "server/base/command_line.h"

#include <gtest/gtest.h>

#include "server/base/number_check.h"

namespace pheromone {
namespace {

struct Program {
  Program() {
    Standardise(&app);
    app.require_subcommand(1);
    CLI::App* drive = app.add_subcommand("drive", "Drive");
    drive->add_option("--id", id, "Robot ID")->check(WholeNumber(1, 254));
    drive->add_option("--speed", speed, "mm/s")->check(CLI::Validator("0 to 1000"));
    drive->add_option("--slip", slip, "Slip")->check(WholeNumber(0, 50))->type_name("PERCENT");
    drive->add_option("--law", law, "Steering law")->check(CLI::IsMember({"paper", "careful"}));
    drive->add_option("--out", out, "Folder")->check(CLI::ExistingDirectory)->type_name("DIR");
    drive->add_option("--modem", modem, "The way to the server")->required();
    drive->add_flag("!--no-bumpers", bumpers, "It has none");
    app.add_subcommand("stop", "Stop");
  }

  std::string ErrorOf(const std::string& arguments) {
    try {
      app.parse(arguments);
    } catch (const CLI::ParseError& error) {
      return ExplainError(&app, error);
    }
    return "";
  }

  CLI::App app{"Robots.", "robots"};
  int id = 1;
  int speed = 200;
  int slip = 0;
  std::string law;
  std::string out;
  std::string modem;
  bool bumpers = true;
};

TEST(CommandLine, AnUnknownCommandIsToldWithThoseThatThereAre) {
  EXPECT_EQ(
      Program().ErrorOf("simulate"),
      "robots: unknown command \"simulate\", expected one of drive, stop\nTry robots --help\n");
  EXPECT_EQ(Program().ErrorOf(""),
            "robots: a command is missing, expected one of drive, stop\nTry robots --help\n");
}

TEST(CommandLine, AMissingOptionIsToldWithWhatItIsFor) {
  EXPECT_EQ(Program().ErrorOf("drive"),
            "robots: --modem is required: The way to the server\nTry robots drive --help\n");
}

TEST(CommandLine, HelpNamesAValueOnce) {
  Program program;
  const std::string help = program.app.get_subcommand("drive")->help();
  EXPECT_NE(help.find("--id 1 to 254 "), std::string::npos) << help;
  EXPECT_NE(help.find("--speed 0 to 1000 "), std::string::npos) << help;
  EXPECT_NE(help.find("--slip PERCENT:0 to 50 "), std::string::npos) << help;
  EXPECT_NE(help.find("--law paper,careful "), std::string::npos) << help;
  EXPECT_NE(help.find("--out DIR "), std::string::npos) << help;
  EXPECT_NE(help.find("--modem TEXT REQUIRED "), std::string::npos) << help;
  EXPECT_NE(help.find("--no-bumpers "), std::string::npos) << help;
  EXPECT_EQ(help.find('{'), std::string::npos) << help;
  EXPECT_EQ(help.find('['), help.find("[OPTIONS]")) << help;
}

}  // namespace
}  // namespace pheromone
