// Between the arrays of a world and those of NumPy.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "client_fw/lab/python/simulation.h"

namespace pheromone::lab::python {

/// A view that cannot be written to, of memory that lives as long as `owner`, which it keeps alive.
template <typename T>
pybind11::array ViewOf(std::span<const T> values, pybind11::object owner) {
  pybind11::array_t<T> view({values.size()}, {sizeof(T)}, values.data(), std::move(owner));
  pybind11::detail::array_proxy(view.ptr())->flags &=
      ~pybind11::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return view;
}

/// What robots are to do, from Python: a number for all of them, or one each.
class ActionReader {
 public:
  /// `first` is the group's first robot; messages name group, or robot, and `step`.
  ActionReader(const RobotGroup& group, size_t first, uint64_t step)
      : group_(group), first_(first), step_(step) {}

  void Read(std::string_view field, pybind11::handle value, double* to) const;
  /// Integers in the range of T.
  template <typename T>
  void Read(std::string_view field, pybind11::handle value, T* to) const;

 private:
  pybind11::array Checked(std::string_view field, pybind11::handle value, std::string_view kinds,
                          std::string_view expected) const;
  template <typename From, typename T>
  void ReadIntegers(std::string_view field, const pybind11::array& array, T* to) const;

  const RobotGroup& group_;
  size_t first_;
  uint64_t step_;
};

extern template void ActionReader::Read(std::string_view, pybind11::handle, uint16_t*) const;
extern template void ActionReader::Read(std::string_view, pybind11::handle, uint8_t*) const;
extern template void ActionReader::Read(std::string_view, pybind11::handle, int8_t*) const;

}  // namespace pheromone::lab::python
