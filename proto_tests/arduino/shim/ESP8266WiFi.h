// ESP8266's header of this name: Arduino.h.
#pragma once

// NOLINTBEGIN: the names are Arduino's

#include <WiFi.h>

// NOLINTEND
