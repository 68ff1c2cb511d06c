// ESP8266's header of this name: Arduino.h.
#pragma once

#include <WiFi.h>
