// The header of the Arduino library: client_fw/boards/arduino/README.md.
#pragma once

#include "client_fw/boards/arduino/facade.h"
#include "client_fw/boards/arduino/serial_link.h"
#include "client_fw/boards/arduino/steppers.h"
#include "client_fw/boards/arduino/two_wheels.h"
#include "client_fw/boards/arduino/wheels.h"

using pheromone::arduino::Pheromone;
using pheromone::arduino::PheromoneSerial;
using pheromone::arduino::PheromoneWheels;
using pheromone::arduino::RollNm;
using pheromone::arduino::StepperConfig;
using pheromone::arduino::Steppers;
using pheromone::arduino::TrackUm;
using pheromone::arduino::TwoWheels;
using pheromone::arduino::WheelConfig;
using pheromone::client::Law;
using pheromone::client::LostTrail;
