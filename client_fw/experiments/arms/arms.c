/* Ants on bridges of several branches, as a plug-in of the lab; README.md says what they do and
 * arms.py runs them.
 *
 * Parameters, in the order of their names: branches, robots of a bridge, bridges of each kind of
 * deposits, tiles in a row, their width and height in metres, kinds; of each kind quanta and
 * exponent; and of each branch x and y of its five corners, from the nest to the food, in its tile.
 * A choice of branch b is counted on the map, as a quantum of pheromone 2 + b. */
#include <math.h>

#include "client_fw/lab/behaviour_abi.h"

enum { kMaxBranches = 5, kCorners = 5, kMaxKinds = 8 };
/* Numbers of a robot's memory. kWhere: state, branch and corner. kTrip: on the way out, metres so
 * far; on the way back, the quanta of a step. kSeen and further: of each branch, or below 0: it has
 * not looked along it. */
enum { kWhere, kTrip, kSeen };
enum { kLook, kOut, kBack, kCutOff };

static const double kPi = 3.14159265358979323846;
static const double kShortestM = 6.6;
static const double kSpeedMPerS = 0.3, kTurnMPerS = 0.2, kLeast = 0.2;

struct Point {
  double x, y;
};

/* What all bridges have in common. */
struct Setup {
  int branches;
  size_t robots, bridges, tiles_a_row;
  double tile_x_m, tile_y_m;
  size_t kinds;
  double quanta[kMaxKinds], exponents[kMaxKinds];
  struct Point corners[kMaxBranches][kCorners];
  double headings[kMaxBranches];
};

/* What a robot is about. */
struct Ant {
  int state, branch, corner;
  double* memory;
};

static int ReadSetup(const struct PheromoneView* view, struct Setup* setup) {
  const struct PheromoneParameter* next = view->parameters;
  if (view->parameter_count < 7) {
    return 0;
  }
  setup->branches = (int)next++->value;
  setup->robots = (size_t)next++->value;
  setup->bridges = (size_t)next++->value;
  setup->tiles_a_row = (size_t)next++->value;
  setup->tile_x_m = next++->value;
  setup->tile_y_m = next++->value;
  setup->kinds = (size_t)next++->value;
  if (setup->branches < 2 || setup->branches > kMaxBranches || setup->kinds < 1 ||
      setup->kinds > kMaxKinds ||
      view->parameter_count != 7 + 2 * setup->kinds + 2 * kCorners * (size_t)setup->branches) {
    return 0;
  }
  for (size_t kind = 0; kind < setup->kinds; ++kind) {
    setup->quanta[kind] = next++->value;
    setup->exponents[kind] = next++->value;
  }
  for (int branch = 0; branch < setup->branches; ++branch) {
    struct Point* corners = setup->corners[branch];
    for (int corner = 0; corner < kCorners; ++corner) {
      corners[corner].x = next++->value;
      corners[corner].y = next++->value;
    }
    setup->headings[branch] = atan2(corners[1].y - corners[0].y, corners[1].x - corners[0].x);
  }
  return 1;
}

static double Within(double angle) {
  return angle - 2 * kPi * rint(angle / (2 * kPi));
}

static void Steer(const struct PheromoneView* view, const struct PheromoneActions* actions,
                  size_t i, double course, int stands) {
  const double aside = Within(course - view->heading_rad[i]);
  const double turn =
      fmax(-kTurnMPerS, fmin(kTurnMPerS, aside * view->wheelbase_m / (2 * view->step_s)));
  const double ahead = stands || fabs(aside) > 0.5 ? 0 : kSpeedMPerS - fabs(turn);
  actions->left_m_s[i] = ahead - turn;
  actions->right_m_s[i] = ahead + turn;
}

/* The nearest branch along which it has not looked, or -1. */
static int NextLook(const struct Setup* setup, const struct Ant* ant, double heading) {
  int next = -1;
  double least = 10;
  for (int branch = 0; branch < setup->branches; ++branch) {
    const double aside = fabs(Within(setup->headings[branch] - heading));
    if (ant->memory[kSeen + branch] < 0 && aside < least) {
      least = aside;
      next = branch;
    }
  }
  return next;
}

/* (k + P)^2 of Deneubourg et al. 1990. `draw`: from 0 to 1. */
static int Choose(const struct Setup* setup, const double* seen, double draw) {
  double sum = 0;
  for (int branch = 0; branch < setup->branches; ++branch) {
    sum += pow(kLeast + seen[branch], 2);
  }
  draw *= sum;
  int branch = 0;
  while (branch < setup->branches - 1 && (draw -= pow(kLeast + seen[branch], 2)) >= 0) {
    ++branch;
  }
  return branch;
}

static void StartLooking(struct Ant* ant) {
  ant->state = kLook;
  for (int branch = 0; branch < kMaxBranches; ++branch) {
    ant->memory[kSeen + branch] = -1;
  }
}

static void TurnBack(struct Ant* ant, double quanta) {
  ant->state = kBack;
  ant->corner -= 1;
  ant->memory[kTrip] = quanta;
}

/* Where it goes: from corner to corner; back from the food with a load, from a wall without one.
 * One that a wall cuts off from the nest goes back to the food and home by any branch, without a
 * trail: it does not know what that costs. */
static double Drive(const struct PheromoneView* view, const struct Setup* setup, struct Ant* ant,
                    size_t i) {
  const size_t tile = (i - view->group_first) / setup->robots;
  const size_t kind = tile / setup->bridges % setup->kinds;
  const double x = view->x_m[i] - setup->tile_x_m * (double)(tile % setup->tiles_a_row);
  const double y = view->y_m[i] - setup->tile_y_m * (double)(tile / setup->tiles_a_row);
  const struct Point* corners = setup->corners[ant->branch];
  const int there = hypot(corners[ant->corner].x - x, corners[ant->corner].y - y) < 0.1;
  if (ant->state == kOut) {
    ant->memory[kTrip] += (view->left_m_s[i] + view->right_m_s[i]) / 2 * view->step_s;
    if (there && ant->corner == kCorners - 1) {
      TurnBack(ant, rint(setup->quanta[kind] *
                         pow(kShortestM / ant->memory[kTrip], setup->exponents[kind])));
    } else if (there) {
      ant->corner += 1;
    } else if (view->contact[i] == kPheromoneWallContact) {
      TurnBack(ant, 0);
    }
  } else if (ant->state == kCutOff && there && ant->corner == kCorners - 1) {
    ant->branch = (int)(setup->branches * PheromoneUniform(view->seed, i, view->step, 1));
    TurnBack(ant, 0);
  } else if (ant->state == kCutOff) {
    ant->corner += there ? 1 : 0;
  } else if (there && ant->corner > 0) {
    ant->corner -= 1;
  } else if (there) {
    StartLooking(ant);
  } else if (view->contact[i] == kPheromoneWallContact) {
    ant->state = kCutOff;
    ant->corner += 1;
  }
  corners = setup->corners[ant->branch];
  return atan2(corners[ant->corner].y - y, corners[ant->corner].x - x);
}

static void Act(const struct PheromoneView* view, const struct PheromoneActions* actions,
                const struct Setup* setup, struct Ant* ant, size_t i) {
  if (ant->state == kLook) {
    int look = NextLook(setup, ant, view->heading_rad[i]);
    if (look >= 0 && fabs(Within(setup->headings[look] - view->heading_rad[i])) < 0.05) {
      ant->memory[kSeen + look] = (view->p_left[0][i] + view->p_right[0][i]) / 4096.0;
      look = NextLook(setup, ant, view->heading_rad[i]);
    }
    if (look >= 0) {
      Steer(view, actions, i, setup->headings[look], 1);
      return;
    }
    ant->branch =
        Choose(setup, ant->memory + kSeen, PheromoneUniform(view->seed, i, view->step, 0));
    ant->state = kOut;
    ant->corner = 1;
    ant->memory[kTrip] = 0;
    actions->quanta[i] = 1;
    actions->type[i] = (uint8_t)(2 + ant->branch);
  }
  Steer(view, actions, i, Drive(view, setup, ant, i), 0);
  if (ant->state == kBack && actions->left_m_s[i] + actions->right_m_s[i] > 0) {
    actions->quanta[i] = (uint16_t)ant->memory[kTrip];
  }
}

int pheromone_behaviour_v1(const struct PheromoneView* view, const struct PheromoneActions* actions,
                           size_t first, size_t count) {
  struct Setup setup;
  if (view->bytes < sizeof *view || !ReadSetup(view, &setup)) {
    return 1;
  }
  for (size_t i = first; i < first + count; ++i) {
    double* memory = actions->memory + i * kPheromoneMemory;
    const int where = (int)memory[kWhere];
    struct Ant ant = {where % 4, where / 4 % 8, where / 32, memory};
    if (view->step == 0) {
      StartLooking(&ant);
    }
    Act(view, actions, &setup, &ant, i);
    actions->sense[i] = ant.state == kLook; /* for the next step */
    memory[kWhere] = ant.state + 4 * ant.branch + 32 * ant.corner;
  }
  return 0;
}
