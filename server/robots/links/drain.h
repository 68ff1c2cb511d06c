// Waiting until a serial port has sent its last bit.
#pragma once

#include <cstdint>

namespace pheromone::links {

/// Blocks until everything written to the terminal `handle`, at `baud` with ten bits a byte, has
/// left it: the driver's buffer, then the UART's FIFO and shift register. What of this a driver
/// tells differs: all tell how much is in the buffer (TIOCOUTQ), most wait for the UART in tcdrain,
/// and those of most UARTs have a line-status register (TIOCSERGETLSR). All of it is asked.
///
/// Gives up a second after the buffer should have been empty, as when the device is dead. (What is
/// left in the UART then, tcdrain waits for no longer than its FIFO should take.)
void Drain(int handle, uint32_t baud);

}  // namespace pheromone::links
