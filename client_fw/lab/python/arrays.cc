#include "client_fw/lab/python/arrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace pheromone::lab::python {
namespace py = pybind11;

py::array ActionReader::Checked(std::string_view field, py::handle value, std::string_view kinds,
                                std::string_view expected) const {
  const auto wrong = [&](const std::string& found, const std::string& wanted) {
    return LabError(fmt::format("group \"{}\", step {}: {}: found {}, expected {}", group_.name,
                                step_, field, found, wanted));
  };
  const size_t count = group_.starts.size();
  const std::string wanted =
      fmt::format("one of {} for all robots, or an array of {}", expected, count);
  const py::array array = py::array::ensure(value);
  if (!array) {
    throw wrong(py::str(py::type::of(value).attr("__name__")), wanted);
  }
  if (kinds.find(array.dtype().kind()) == std::string_view::npos) {
    throw wrong("dtype " + std::string(py::str(array.dtype())), wanted);
  }
  if (array.ndim() > 1 || (array.ndim() == 1 && array.size() != static_cast<py::ssize_t>(count))) {
    throw wrong("shape " + std::string(py::str(array.attr("shape"))), wanted);
  }
  return array;
}

void ActionReader::Read(std::string_view field, py::handle value, double* to) const {
  const py::array array = Checked(field, value, "fiub", "these numbers");
  const auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>(array);
  const size_t count = group_.starts.size();
  if (array.ndim() == 0) {
    std::fill_n(to, count, *numbers.data());
  } else {
    std::copy_n(numbers.data(), count, to);
  }
}

template <typename From, typename T>
void ActionReader::ReadIntegers(std::string_view field, const py::array& array, T* to) const {
  constexpr int64_t kLeast = std::numeric_limits<T>::min();
  constexpr int64_t kMost = std::numeric_limits<T>::max();
  const auto numbers = py::array_t<From, py::array::c_style | py::array::forcecast>(array);
  const bool is_one = array.ndim() == 0;
  for (size_t i = 0; i < group_.starts.size(); ++i) {
    const From number = numbers.data()[is_one ? 0 : i];
    if (std::cmp_less(number, kLeast) || std::cmp_greater(number, kMost)) {
      throw LabError(fmt::format("{}, step {}: {} is {}, expected {} to {}",
                                 NameOf(group_, first_ + i), step_, field, number, kLeast, kMost));
    }
    to[i] = static_cast<T>(number);
  }
}

template <typename T>
void ActionReader::Read(std::string_view field, py::handle value, T* to) const {
  const py::array array = Checked(field, value, "iub", "these integers");
  if (array.dtype().kind() == 'u') {
    ReadIntegers<uint64_t>(field, array, to);
  } else {
    ReadIntegers<int64_t>(field, array, to);
  }
}

template void ActionReader::Read(std::string_view, py::handle, uint16_t*) const;
template void ActionReader::Read(std::string_view, py::handle, uint8_t*) const;
template void ActionReader::Read(std::string_view, py::handle, int8_t*) const;

}  // namespace pheromone::lab::python
