// What the example uses of Pololu's library of this name, which Debian does not have: for
// compiling.
#pragma once

#include <stdint.h>

class Romi32U4Motors {
 public:
  void setSpeeds(int16_t left, int16_t right) {
    left_ = left;
    right_ = right;
  }

 private:
  volatile int16_t left_ = 0;
  volatile int16_t right_ = 0;
};

class Romi32U4Encoders {
 public:
  int16_t getCountsLeft() { return left_; }
  int16_t getCountsRight() { return right_; }

 private:
  volatile int16_t left_ = 0;
  volatile int16_t right_ = 0;
};
