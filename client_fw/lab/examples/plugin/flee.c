/* A behaviour that keeps away from the others: it turns from the side where it senses more of the
 * pheromone that all of them leave, and turns back at what it runs into.
 *
 *   cc -std=c99 -O2 -shared -fPIC -I TREE -o flee.so flee.c -lm
 *
 * with TREE the folder of the project; plugin.toml beside this file runs it. */
#include <math.h>

#include "client_fw/lab/behaviour_abi.h"

static double ParameterOf(const struct PheromoneView* view, const char* name, double fallback) {
  for (size_t i = 0; i < view->parameter_count; ++i) {
    if (strcmp(view->parameters[i].name, name) == 0) {
      return view->parameters[i].value;
    }
  }
  return fallback;
}

int pheromone_behaviour_v1(const struct PheromoneView* view, const struct PheromoneActions* actions,
                           size_t first, size_t count) {
  if (view->bytes < sizeof *view || view->slots < 1) {
    return 1; /* an older lab, or a group that senses nothing */
  }
  const double speed = ParameterOf(view, "speed_m_per_s", 0.2);
  for (size_t i = first; i < first + count; ++i) {
    /* Steps for which it still turns on the spot. */
    double* turning = &actions->memory[i * kPheromoneMemory];
    if (view->contact[i] != kPheromoneNoContact && *turning <= 0) {
      *turning = ceil((2 + 4 * PheromoneUniform(view->seed, i, view->step, 0)) / view->step_s);
    }
    actions->quanta[i] = 1;
    if (*turning > 0) {
      *turning -= 1;
      actions->left_m_s[i] = speed / 2;
      actions->right_m_s[i] = -speed / 2;
      continue;
    }
    /* Towards the weaker side. */
    const double aside = (view->p_right[0][i] - view->p_left[0][i]) / 4096.0;
    const double turn = fmax(-1, fmin(1, aside)) * speed / 2;
    actions->left_m_s[i] = speed - fmax(turn, 0);
    actions->right_m_s[i] = speed + fmin(turn, 0);
  }
  return 0;
}
