/* Two cleaning robots on a grid of zones (Tammet, Vain and Kuusik 2006, section 4), written by hand
 * from the rules and not from the C++ code, which client_fw/verify explores: see spin_test.cc.
 *
 * Defined on the command line: COLUMNS, ROWS, D (how long cleaning takes), HORIZON, and START_A and
 * START_B, or neither for any start. SOIL: level of soil at the start, in 5 %; zones are then to stay
 * below 51 %. REPORT: print each state. UNCONDITIONAL: claims name no condition.
 */
#define ZONES (COLUMNS * ROWS)
#define NONE 32767

#define DECIDING 0
#define CLAIMING 1
#define CLEANING 2

short stamp[ZONES];   /* when it was cleaned last */
bit occupied[ZONES];  /* the sign on its tag */
byte zone[2];
byte phase[2];
byte timer[2];
bit stale[2];  /* another has written on the tag since it was read */
short clock;
#ifdef SOIL
byte level[ZONES];
byte tick = 15;
#endif

hidden short oldest;
hidden byte z;
hidden byte passed;

#define HAS_UP(z) ((z) % ROWS != ROWS - 1)
#define HAS_DOWN(z) ((z) % ROWS != 0)
#define HAS_LEFT(z) ((z) >= ROWS)
#define HAS_RIGHT(z) ((z) + ROWS < ZONES)
#define IS_OLDEST(z) (!occupied[z] && stamp[z] == oldest)
#define OTHER(r) (1 - (r))
#define DUE(r) (timer[r] == 0)

inline see(it) {
  if
  :: !occupied[it] && stamp[it] < oldest -> oldest = stamp[it]
  :: else
  fi
}

inline decide(r) {
  z = zone[r];
  oldest = NONE;
  see(z);
  if :: HAS_UP(z) -> see(z + 1) :: else fi;
  if :: HAS_DOWN(z) -> see(z - 1) :: else fi;
  if :: HAS_LEFT(z) -> see(z - ROWS) :: else fi;
  if :: HAS_RIGHT(z) -> see(z + ROWS) :: else fi;
  if
  :: oldest == NONE -> timer[r] = 1
  :: oldest != NONE && IS_OLDEST(z) -> phase[r] = CLAIMING; stale[r] = 0
  :: oldest != NONE && !IS_OLDEST(z) ->
    timer[r] = 1;
    if
    :: HAS_UP(z) && IS_OLDEST(z + 1) -> zone[r] = z + 1
    :: HAS_DOWN(z) && IS_OLDEST(z - 1) -> zone[r] = z - 1
    :: HAS_LEFT(z) && IS_OLDEST(z - ROWS) -> zone[r] = z - ROWS
    :: HAS_RIGHT(z) && IS_OLDEST(z + ROWS) -> zone[r] = z + ROWS
    fi
  fi
}

#ifdef UNCONDITIONAL
#define REFUSED(r) false
#else
#define REFUSED(r) stale[r]
#endif

inline claim(r) {
  if
  :: REFUSED(r) -> phase[r] = DECIDING; stale[r] = 0
  :: else ->
    occupied[zone[r]] = 1;
    phase[r] = CLEANING;
    timer[r] = D;
    stale[r] = 0;
    if
    :: phase[OTHER(r)] == CLAIMING && zone[OTHER(r)] == zone[r] -> stale[OTHER(r)] = 1
    :: else
    fi;
    assert(!(phase[OTHER(r)] == CLEANING && zone[OTHER(r)] == zone[r]))
  fi
}

inline finish(r) {
  stamp[zone[r]] = clock;
  occupied[zone[r]] = 0;
  phase[r] = DECIDING;
#ifdef SOIL
  level[zone[r]] = 0;
#endif
}

inline act(r) {
  if
  :: phase[r] == DECIDING -> decide(r)
  :: phase[r] == CLAIMING -> claim(r)
  :: phase[r] == CLEANING -> finish(r)
  fi
}

#ifdef SOIL
#define RATE(z) ((z) >= 4 && (z) <= 7 || (z) == 10 -> 2 : 1)

inline soil() {
  tick = 15;
  z = 0;
  do
  :: z < ZONES ->
    if
    :: !occupied[z] ->
      level[z] = level[z] + RATE(z);
      assert(level[z] <= 10)
    :: else
    fi;
    z++
  :: else -> break
  od
}
#endif

/* Time passes until something is due. */
inline advance() {
  passed = (timer[0] < timer[1] -> timer[0] : timer[1]);
#ifdef SOIL
  passed = (tick < passed -> tick : passed);
  tick = tick - passed;
#endif
  timer[0] = timer[0] - passed;
  timer[1] = timer[1] - passed;
  clock = clock + passed
}

inline report() {
#ifdef REPORT
  c_code {
    int i;
    printf("state %d", now.clock);
    for (i = 0; i < 2; ++i) {
      printf(" %d %d %d %d", now.phase[i], now.zone[i], now.timer[i], now.stale[i]);
    }
    for (i = 0; i < ZONES; ++i) {
      printf(" %d %d", now.occupied[i], now.stamp[i]);
    }
    printf("\n");
  }
#else
  skip
#endif
}

init {
  atomic {
#ifdef START_A
    zone[0] = START_A;
    zone[1] = START_B;
#else
    do :: zone[0] < ZONES - 1 -> zone[0]++ :: break od;
    do :: zone[1] < ZONES - 1 -> zone[1]++ :: break od;
#endif
#ifdef SOIL
    z = 0;
    do :: z < ZONES -> level[z] = SOIL; z++ :: else -> break od;
#endif
    report()
  }
  do
  :: atomic { clock < HORIZON && DUE(0) -> act(0); advance(); report() }
  :: atomic { clock < HORIZON && DUE(1) -> act(1); advance(); report() }
#ifdef SOIL
  :: atomic { clock < HORIZON && tick == 0 -> soil(); advance() }
#endif
  :: clock >= HORIZON -> break
  od
}
