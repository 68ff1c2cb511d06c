// pheromone-tracker: a camera above the robots tells the server where they are.
//
// Exit status: 0 done, or ended as told; 1 it failed, or check found no camera; 2 the command line
// or a file is wrong.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "client_fw/boards/host/real_time.h"
#include "client_fw/tracker/annotated.h"
#include "client_fw/tracker/calibration.h"
#include "client_fw/tracker/camera_device.h"
#include "client_fw/tracker/figures.h"
#include "client_fw/tracker/sender.h"
#include "client_fw/tracker/settings.h"
#include "client_fw/tracker/sheets.h"
#include "client_fw/tracker/simulated_swarm.h"
#include "client_fw/tracker/tracking.h"
#include "server/base/command_line.h"
#include "server/base/file.h"
#include "server/base/number_check.h"
#include "server/base/program.h"
#include "server/base/say_line.h"
#include "server/operators/ctl/pdf.h"

namespace pheromone::tracker {
namespace {

constexpr char kProgram[] = "pheromone-tracker";
constexpr double kSimulatedPeriodS = 0.1;
constexpr double kDegreesOfRadian = 180 / std::numbers::pi;

struct Options {
  std::string config;
  std::vector<std::string> pictures;
  std::string out;
  bool simulate = false;
  bool pdf = false;
  double noise = Blemishes().noise;
  double blur_px = Blemishes().blur_px;
  int count = 0;
  double seconds = 0;
  double status_s = 10;
};

// Where pictures come from: nothing after the last one.
using Source = std::function<Result<std::optional<Picture>>()>;

struct Input {
  Settings settings;
  Source next;
  std::optional<SimulatedSwarm> swarm;
  double simulated_s = 0;  // of the last picture
};

Source FilesOf(const std::vector<std::string>& paths, const Settings& settings) {
  return [paths, settings, index = size_t{0}]() mutable -> Result<std::optional<Picture>> {
    if (index == paths.size()) {
      return std::optional<Picture>();
    }
    const std::string& path = paths[index++];
    PHEROMONE_TRY(Picture picture, LoadPicture(path));
    if (picture.width != settings.width || picture.height != settings.height) {
      return Error{fmt::format("{}: found {} x {} pixels, expected those of [camera], {} x {}",
                               path, picture.width, picture.height, settings.width,
                               settings.height)};
    }
    return std::optional(std::move(picture));
  };
}

// The pictures that the options ask for; `input` outlives its source.
Status Open(const Options& options, bool needs_lens, Input* input) {
  PHEROMONE_TRY(input->settings, LoadSettings(options.config));
  if (needs_lens || options.simulate) {
    PHEROMONE_TRY_STATUS(CheckLens(input->settings));
  }
  if (options.simulate) {
    input->swarm.emplace(input->settings,
                         Blemishes{.noise = options.noise, .blur_px = options.blur_px});
    input->next = [input, number = 0]() mutable -> Result<std::optional<Picture>> {
      input->simulated_s = kSimulatedPeriodS * number++;
      return std::optional(input->swarm->PictureAt(input->simulated_s));
    };
  } else if (!options.pictures.empty()) {
    input->next = FilesOf(options.pictures, input->settings);
  } else {
    auto camera =
        CameraDevice::Open(input->settings.device, input->settings.width, input->settings.height);
    if (!camera.ok()) {
      return camera.error();
    }
    auto shared = std::make_shared<CameraDevice>(std::move(camera).value());
    input->next = [shared]() -> Result<std::optional<Picture>> {
      PHEROMONE_TRY(Picture picture, shared->Next());
      return std::optional(std::move(picture));
    };
  }
  return Ok();
}

double ProcessorSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double Now() {
  return static_cast<double>(MonotonicNs()) / 1e9;
}

// Until the pictures end, or as long as told. Prints a line each `status_s`, and at the end.
Status Follow(const Options& options, Input* input) {
  PHEROMONE_TRY(Sender sender, Sender::Open(input->settings.server));
  const volatile std::sig_atomic_t* stop = StopOnSignals();
  Tracking tracking(input->settings);
  Detector detector;
  Figures figures(input->settings);
  const double start = Now();
  double since = start;
  std::string trouble;
  const auto report = [&] {
    const double now = Now();
    SayLine(std::llround(1000 * (now - start)),
            figures.Line(now - since) + (trouble.empty() ? "" : "; " + trouble));
    figures.Clear();
    trouble.clear();
    since = now;
  };
  for (int number = 0; *stop == 0 && (options.count == 0 || number < options.count) &&
                       (options.seconds == 0 || Now() - start < options.seconds);
       ++number) {
    if (options.simulate) {  // the camera's pace
      std::this_thread::sleep_for(
          std::chrono::duration<double>(start + kSimulatedPeriodS * number - Now()));
    }
    PHEROMONE_TRY(const std::optional<Picture> picture, input->next());
    if (!picture) {
      break;
    }
    const double begin = ProcessorSeconds();
    const View view = tracking.Locate(detector.Detect(*picture));
    figures.Add(view, ProcessorSeconds() - begin);
    for (const SeenRobot& it : view.seen) {
      for (size_t i = 0; input->swarm && i < input->settings.robots.size(); ++i) {
        if (input->settings.robots[i].tag == it.robot.tag) {
          figures.AddError(it, input->swarm->PoseAt(input->simulated_s, i));
        }
      }
    }
    for (const std::string& it : Datagrams(view.seen)) {
      if (const Status sent = sender.Send(it); !sent.ok()) {
        trouble = sent.error();
      }
    }
    if (Now() - since >= options.status_s) {
      report();
    }
  }
  if (figures.pictures() > 0) {
    report();
  }
  return Ok();
}

int Run(const Options& options) {
  Input input;
  if (const Status opened = Open(options, true, &input); !opened.ok()) {
    return Fail(kProgram, opened.error(), kWrongInput);
  }
  const Status followed = Follow(options, &input);
  return followed.ok() ? 0 : Fail(kProgram, followed.error(), kFailed);
}

// How far each is from where it should be: one that was measured wrong stands out.
void PrintFloorTags(const Settings& settings, const Camera& camera,
                    const std::vector<Detection>& found) {
  for (const FloorTag& it : settings.floor) {
    for (const Detection& tag : found) {
      const auto pose =
          tag.id == it.tag ? FitTag(camera, tag.corners, settings.floor_edge_m, 0) : std::nullopt;
      if (pose) {
        fmt::print(
            "floor {}  {:.0f} mm, {:.1f} degrees from where it should be; edge {:.4f} m\n", it.tag,
            1000 * (pose->centre - it.place).norm(),
            std::abs(std::remainder(pose->heading_rad - it.heading_rad, 2 * std::numbers::pi)) *
                kDegreesOfRadian,
            pose->edge_m);
      }
    }
  }
}

int Check(const Options& options) {
  Input input;
  if (Status opened = Open(options, true, &input); !opened.ok()) {
    return Fail(kProgram, opened.error(), kWrongInput);
  }
  const auto picture = input.next();
  if (!picture.ok()) {
    return Fail(kProgram, picture.error(), kFailed);
  }
  const std::vector<Detection> found = Detector().Detect(*picture.value());
  const View view = Tracking(input.settings).Locate(found);
  if (!options.out.empty()) {
    const auto svg = AnnotatedSvg(*picture.value(), input.settings, view);
    const Status written = svg.ok() ? WriteFile(options.out, svg.value()) : svg.error();
    if (!written.ok()) {
      return Fail(kProgram, written.error(), kFailed);
    }
  }
  if (!view.camera) {
    return Fail(kProgram, view.why_no_camera, kFailed);
  }
  const Eigen::Vector3d place = view.camera->camera.place();
  fmt::print("camera  at x {:.3f}, y {:.3f}, {:.3f} m high; floor tags {} of {}, {:.2f} px\n",
             place.x(), place.y(), place.z(), view.floor_seen.size(), input.settings.floor.size(),
             view.camera->rms_px);
  PrintFloorTags(input.settings, view.camera->camera, found);
  for (const SeenRobot& it : view.seen) {
    fmt::print("{} {}  x {:.3f}, y {:.3f}, {:.1f} degrees; edge {:.4f} m, {:.2f} px\n",
               it.robot.link, it.robot.id, it.place.x(), it.place.y(),
               it.heading_rad * kDegreesOfRadian, it.tag.edge_m, it.tag.rms_px);
  }
  for (const RejectedTag& it : view.rejected) {
    fmt::print("{} {}  rejected: {}\n", it.robot.link, it.robot.id, it.why);
  }
  for (const RobotTag& it : view.missed) {
    fmt::print("{} {}  tag {} was not found\n", it.link, it.id, it.tag);
  }
  return 0;
}

int Photograph(const Options& options) {
  Input input;
  if (const Status opened = Open(options, false, &input); !opened.ok()) {
    return Fail(kProgram, opened.error(), kWrongInput);
  }
  const auto picture = input.next();
  const auto png = picture.ok() ? EncodePng(*picture.value()) : picture.error();
  const Status written = png.ok() ? WriteFile(options.out, png.value()) : png.error();
  return written.ok() ? 0 : Fail(kProgram, written.error(), kFailed);
}

int Calibrate(const Options& options) {
  const auto found = FitLensOfFiles(Board(), options.pictures);
  if (!found.ok()) {
    return Fail(kProgram, found.error(), kWrongInput);
  }
  const auto& [fit, width, height, used] = found.value();
  fmt::print(
      "# {} of {} pictures, {:.2f} px; the focal length is known to {:.1f} px; the board covered "
      "{:.0f} % of the way from the middle to the corners\n[camera]\nwidth_px = {}\nheight_px = "
      "{}\nfocal_px = {:.2f}\ncentre_x_px = {:.2f}\ncentre_y_px = {:.2f}\nk1 = {:.5f}\nk2 = "
      "{:.5f}\n",
      used, options.pictures.size(), fit.rms_px, fit.focal_error_px, 100 * fit.covered, width,
      height, fit.lens.focal_px, fit.lens.centre_px.x(), fit.lens.centre_px.y(), fit.lens.k1,
      fit.lens.k2);
  return 0;
}

Status WriteSheet(const Options& options, const std::string& name, const std::string& svg) {
  const std::filesystem::path path = std::filesystem::path(options.out) / name;
  if (!options.pdf) {
    return WriteFile(path.string() + ".svg", svg);
  }
  PHEROMONE_TRY(const std::string pdf, ctl::SvgToPdf(svg));
  return WriteFile(path.string() + ".pdf", pdf);
}

int Print(const Options& options) {
  const auto settings = LoadSettings(options.config);
  if (!settings.ok()) {
    return Fail(kProgram, settings.error(), kWrongInput);
  }
  std::vector<std::pair<std::string, std::string>> sheets = {{"board", BoardSheet(Board())}};
  for (const FloorTag& it : settings.value().floor) {
    sheets.emplace_back(
        fmt::format("tag-{}", it.tag),
        TagSheet(it.tag, settings.value().floor_edge_m,
                 fmt::format("floor: x {:.3f} m, y {:.3f} m, heading {:.0f} degrees", it.place.x(),
                             it.place.y(), it.heading_rad * kDegreesOfRadian)));
  }
  for (const RobotTag& it : settings.value().robots) {
    sheets.emplace_back(fmt::format("tag-{}", it.tag),
                        TagSheet(it.tag, settings.value().robot_edge_m,
                                 fmt::format("robot {} {}", it.link, it.id)));
  }
  std::error_code error;
  std::filesystem::create_directories(options.out, error);
  for (const auto& [name, svg] : sheets) {
    if (const Status written = WriteSheet(options, name, svg); !written.ok()) {
      return Fail(kProgram, written.error(), kFailed);
    }
  }
  fmt::print("{} sheets in {}\n", sheets.size(), options.out);
  return 0;
}

void AddConfig(CLI::App* command, Options* options) {
  command->add_option("CONFIG", options->config, "The configuration, a TOML file")->required();
}

void AddSimulation(CLI::App* command, Options* options) {
  auto* const simulate = command->add_flag("--simulate", options->simulate,
                                           "Render the pictures, of robots on an ellipse");
  command->add_option("--noise", options->noise, "Noise of rendered pictures, levels of 255")
      ->check(Number(0, 100))
      ->needs(simulate);
  command->add_option("--blur", options->blur_px, "Blur of rendered pictures, pixels")
      ->check(Number(0, 3))
      ->needs(simulate);
}

int Main(int argc, char** argv) {
  Options options;
  int status = 0;
  CLI::App app{"Tells a pheromone server where robots are, as a camera above them sees their tags.",
               kProgram};
  Standardise(&app);
  app.set_version_flag("--version", "pheromone-tracker " PHEROMONE_VERSION);
  app.require_subcommand(1);

  auto* const print = app.add_subcommand("print", "Write sheets with tags, and the board");
  AddConfig(print, &options);
  print->add_option("FOLDER", options.out, "Where the sheets go")->required();
  print->add_flag("--pdf", options.pdf, "As PDF; otherwise SVG");
  print->callback([&] { status = Print(options); });

  auto* const take = app.add_subcommand("take", "Take a picture");
  AddConfig(take, &options);
  take->add_option("OUT", options.out, "A PNG file")->required();
  AddSimulation(take, &options);
  take->callback([&] { status = Photograph(options); });

  auto* const calibrate =
      app.add_subcommand("calibrate", "Find the lens from pictures of the board, and print it");
  calibrate->add_option("PICTURE", options.pictures, "PNG, JPEG or PGM; ten or more")->required();
  calibrate->callback([&] { status = Calibrate(options); });

  auto* const check = app.add_subcommand("check", "Say what is in one picture");
  AddConfig(check, &options);
  auto* const one = check->add_option("PICTURE", options.pictures,
                                      "PNG, JPEG or PGM; without it, the camera takes one");
  one->expected(0, 1);
  AddSimulation(check, &options);
  check->get_option("--simulate")->excludes(one);
  check->add_option("--svg", options.out, "Write the picture with what was found in it");
  check->callback([&] { status = Check(options); });

  auto* const run = app.add_subcommand("run", "Report the robots' poses to the server");
  AddConfig(run, &options);
  auto* const files =
      run->add_option("--pictures", options.pictures, "Files in place of the camera");
  AddSimulation(run, &options);
  run->get_option("--simulate")->excludes(files);
  run->add_option("--count", options.count, "End after so many pictures")
      ->check(WholeNumber(1, 1'000'000'000));
  run->add_option("--seconds", options.seconds, "End after this time")->check(Number(0.1, 1e7));
  run->add_option("--status", options.status_s, "Print a line every so many seconds (default: 10)")
      ->check(Number(0.1, 1e7));
  run->callback([&] { status = Run(options); });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongInput;
  }
  return status;
}

}  // namespace
}  // namespace pheromone::tracker

int main(int argc, char** argv) {
  return pheromone::RunProgram(pheromone::tracker::kProgram,
                               [&] { return pheromone::tracker::Main(argc, argv); });
}
