// Stands in for the ESP32 core's header of this name; see Arduino.h.
#pragma once

// NOLINTBEGIN: the names are Espressif's

enum esp_reset_reason_t { ESP_RST_POWERON = 1, ESP_RST_BROWNOUT = 9 };

esp_reset_reason_t esp_reset_reason();

// NOLINTEND
