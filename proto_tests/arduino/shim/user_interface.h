// Stands in for the ESP8266 core's header of this name; see Arduino.h.
#pragma once

// NOLINTBEGIN: the names are Espressif's

#include <stdint.h>

enum rst_reason { REASON_DEFAULT_RST = 0, REASON_WDT_RST = 1 };

struct rst_info {
  uint32_t reason;
};

// NOLINTEND
