/* What a test may set and see of the serial ports that pty_as_serial_shim.c makes of
 * pseudo-terminals. Any thread; they are the same for every pseudo-terminal. */
#pragma once

#ifdef __cplusplus
extern "C" {
#endif

/* The lines that a modem raises: TIOCM_CAR, TIOCM_CTS. */
void PtyShimSetInputs(int lines);
/* The lines that were raised by the program: TIOCM_RTS, TIOCM_DTR. */
int PtyShimOutputs(void);

/* A driver that hangs: from now on, or no longer, asking for the modem lines or the counters takes
 * forever, and so does switching the lines. Opening a port does that. */
void PtyShimHang(int hang);
/* How many threads it holds. */
int PtyShimHeld(void);

/* What the driver has counted. Until the first call, it has no counters. */
struct PtyShimCounts {
  int framing;
  int parity;
  int overruns;
  int buffer_overruns;
  int breaks;
};
void PtyShimSetCounts(struct PtyShimCounts counts);

/* Whether the driver switches the direction of RS-485 lines; and how it was told to. */
struct PtyShimRs485 {
  int supported;
  int flags;
  int delay_before_ms;
  int delay_after_ms;
};
void PtyShimSetRs485(int supported);
struct PtyShimRs485 PtyShimGetRs485(void);

#ifdef __cplusplus
}
#endif
