// A value of a class derived from `Base`, copied as that class; like std::polymorphic of C++26.
//
//   std::vector<Polymorphic<Shape>> shapes;
//   shapes.emplace_back(std::make_unique<Circle>(3));
//   std::vector<Polymorphic<Shape>> same = shapes;   // Base::Clone for each
//
// Not thread-safe.
#pragma once

#include <cassert>
#include <memory>
#include <type_traits>
#include <utility>

namespace pheromone {

template <typename Base>
class Polymorphic {
 public:
  /// `value` is not null.
  template <typename Derived>
  Polymorphic(std::unique_ptr<Derived> value)  // NOLINT(google-explicit-constructor)
      : value_(std::move(value)) {
    static_assert(std::has_virtual_destructor_v<Base>);
    assert(value_ != nullptr);
  }
  Polymorphic(const Polymorphic& other) : value_(other.value_->Clone()) {}
  Polymorphic(Polymorphic&&) noexcept = default;
  Polymorphic& operator=(const Polymorphic& other) { return *this = Polymorphic(other); }
  Polymorphic& operator=(Polymorphic&&) noexcept = default;
  ~Polymorphic() = default;

  Base& operator*() { return *value_; }
  const Base& operator*() const { return *value_; }
  Base* operator->() { return value_.get(); }
  const Base* operator->() const { return value_.get(); }

 private:
  std::unique_ptr<Base> value_;
};

}  // namespace pheromone
