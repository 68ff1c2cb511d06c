#include "protocol/coded_frame.h"

namespace pheromone {
namespace protocol {

void RepairCoded(uint8_t* bytes, uint8_t rows) {
  uint8_t* sum = bytes + static_cast<uint8_t>(kCodedColumns * rows);
  const uint8_t* p = sum + kCodedColumns;
  uint8_t* beyond = nullptr;  // the row with more damage than one byte
  for (uint8_t row = 0; row <= rows; ++row, ++p) {
    // Its bytes: the last row's are one after the other.
    uint8_t* const first = row < rows ? bytes + row : sum;
    const uint8_t step = row < rows ? rows : uint8_t{1};
    uint8_t difference = *p;
    uint8_t weighted = 0;
    uint8_t* at = first + static_cast<uint8_t>(kCodedColumns * step);
    do {
      at -= step;
      difference ^= *at;
      weighted = static_cast<uint8_t>(CodedDouble(weighted) ^ *at);
    } while (at != first);
    weighted ^= p[rows + 1];
    // If only one of them is not 0, P or Q is damaged itself.
    if (difference == 0 || weighted == 0) {
      continue;
    }
    // The damaged byte is where doubling leads from one to the other.
    uint8_t left = kCodedColumns;
    for (uint8_t power = difference; power != weighted && left != 0; --left) {
      power = CodedDouble(power);
      at += step;
    }
    if (left != 0) {
      *at ^= difference;
    } else {
      beyond = first;
    }
  }
  if (beyond == nullptr || beyond == sum) {
    return;
  }
  // The bytes of a column are one after the other; with the sum's they give 0.
  for (uint8_t column = kCodedColumns; column != 0; --column) {
    uint8_t missing = *sum++;
    for (uint8_t row = rows; row != 0; --row) {
      missing = static_cast<uint8_t>(missing ^ *bytes++);
    }
    *beyond ^= missing;
    beyond += rows;
  }
}

}  // namespace protocol
}  // namespace pheromone
