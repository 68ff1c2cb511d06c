// The configuration of a server on whose tags simulated robots clean a floor in real time.
#include <fmt/format.h>

#include "client_fw/core/tasks/cleaner.h"
#include "client_fw/experiments/cleaning/experiment.h"

namespace pheromone::swarm {

std::string ServerText(const CleaningExperiment& experiment) {
  const CleaningGrid& grid = experiment.grid;
  std::string text = fmt::format(
      "# The server of a floor that cleaning robots coordinate on: a tag in each zone.\n"
      "[map]\nwidth_m = {:.3f}\nheight_m = {:.3f}\ncell_m = 0.1\n\n"
      "[antennas]\nbias_m = 0.33\n\n"
      "# Robots that clean ask for intensities all the same.\n"
      "[[pheromone]]\ntype = 1\nname = \"unused\"\ncore_m = 0.1\nsigma_m = 0.4\ntau_s = 30.0\n"
      "quantum = 0.125\nmaximum = 1.0\n\n"
      "[tags]\nprivileged = [\"operator\"]\n",
      grid.width_m(), grid.height_m());
  for (int zone = 0; zone < grid.zones(); ++zone) {
    text += fmt::format(
        "\n[[tag]]\nname = \"zone-{}\"\nx_m = {:.3f}\ny_m = {:.3f}\nrange_m = {:.3f}\nslots = {}\n",
        zone + 1, grid.CentreX(zone), grid.CentreY(zone), grid.RangeOf(zone), experiment.slots);
    if (experiment.IsClosed(zone)) {
      text += fmt::format(
          "# It is closed by an operator's sign, to be written once the server runs:\n"
          "# pheromonectl tags write zone-{0} 'tag:{0} <{1}keepAway> \"closed\"'\n",
          zone + 1, client::kCleaningBase);
    }
  }
  for (int channel = 1; channel <= experiment.channels; ++channel) {
    text += fmt::format(
        "\n[[link]]\nname = \"radio-{0}\"\nkind = \"pty\"\npath = \"radio-{0}.pty\"\n", channel);
  }
  return text;
}

}  // namespace pheromone::swarm
