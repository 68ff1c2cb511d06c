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
/* A driver that is slow: each of these calls takes so long; 0: as long as it takes. */
void PtyShimSlow(int ms);
/* How many of these calls there were. */
int PtyShimCalls(void);

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

/* A UART whose bits take their time, to see whether a transceiver is keyed from the first to the
 * last. From PtyShimSetUart on, the bytes that a program writes to the port leave at the baud rate
 * that it has set, ten bits each, without gaps, after having passed through a FIFO. (A test reads
 * them from the master as soon as they are written.)
 *
 *   PtyShimSetUart((struct PtyShimUart){.fifo = 16, .key_line = TIOCM_RTS, .has_lsr = 1});
 *   ... the program keys, writes, waits, unkeys ...
 *   PtyShimAir().bytes == what was written, PtyShimAir().cut == 0
 *
 * In the test of a link (serial_bench.h), the link is the program: ask, wait until PtyShimOutputs()
 * has the line lowered again, look at PtyShimAir().
 *
 * What counts is the order of events on one clock: a slow machine cannot make a right program look
 * wrong. PtyShimStopUart(1) stops that clock, so that a wrong one cannot be lucky: nothing leaves
 * until PtyShimStopUart(0). */
struct PtyShimUart {
  int fifo;         /* bytes besides that in the shift register; 0: bits take no time */
  int key_line;     /* TIOCM_RTS, TIOCM_DTR; 0: none */
  int has_lsr;      /* the driver tells whether the shift register is empty (TIOCSERGETLSR) */
  int drains_early; /* tcdrain returns when the FIFO has the last byte, like the worst drivers */
};
/* Also forgets what was sent, and starts the clock. */
void PtyShimSetUart(struct PtyShimUart uart);
void PtyShimStopUart(int stop);

struct PtyShimSent {
  long long bytes;   /* given to the UART */
  long long cut;     /* of these, without the line raised from the first to the last bit, or
                      * flushed before they left */
  long long tail_ns; /* from the last bit to when the line was last lowered */
};
struct PtyShimSent PtyShimAir(void);
/* How often the driver was asked what is still to be sent. */
int PtyShimAsked(void);

#ifdef __cplusplus
}
#endif
