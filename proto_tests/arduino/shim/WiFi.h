// ESP32's header of this name: Arduino.h.
#pragma once

// NOLINTBEGIN: the names are Arduino's

namespace shim {

enum WiFiMode { WIFI_STA };
enum WiFiStatus { WL_CONNECTED };

class WiFiClass {
 public:
  void mode(WiFiMode /*mode*/) {}
  void begin(const char* /*network*/, const char* /*password*/) {}
  WiFiStatus status() { return WL_CONNECTED; }
};

extern WiFiClass WiFi;

}  // namespace shim

using namespace shim;

// NOLINTEND
