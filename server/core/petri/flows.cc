#include "server/core/petri/flows.h"

#include <algorithm>
#include <numeric>
#include <optional>

namespace pheromone::petri {
namespace {

constexpr size_t kMaxRows = 20'000;                // at a time; there can be exponentially many
constexpr size_t kMaxRowComparisons = 50'000'000;  // of rows, which is what takes time

using Terms = std::vector<FlowTerm>;

// A row of the matrix that is eliminated, and how it was made of the first rows.
struct Row {
  Terms left;
  Terms made_of;
};

int64_t WeightAt(const Terms& terms, uint32_t index) {
  const auto found =
      std::lower_bound(terms.begin(), terms.end(), index,
                       [](const FlowTerm& term, uint32_t at) { return term.index < at; });
  return found != terms.end() && found->index == index ? found->weight : 0;
}

// a * x + b * y; nothing if a number does not fit.
std::optional<Terms> Combined(const Terms& x, int64_t a, const Terms& y, int64_t b) {
  Terms sum;
  sum.reserve(x.size() + y.size());
  size_t i = 0;
  size_t j = 0;
  while (i < x.size() || j < y.size()) {
    const uint32_t index =
        j == y.size() || (i < x.size() && x[i].index < y[j].index) ? x[i].index : y[j].index;
    int64_t of_x = 0;
    int64_t of_y = 0;
    int64_t weight = 0;
    if (i < x.size() && x[i].index == index && __builtin_mul_overflow(x[i++].weight, a, &of_x)) {
      return std::nullopt;
    }
    if (j < y.size() && y[j].index == index && __builtin_mul_overflow(y[j++].weight, b, &of_y)) {
      return std::nullopt;
    }
    if (__builtin_add_overflow(of_x, of_y, &weight) ||
        weight == std::numeric_limits<int64_t>::min()) {
      return std::nullopt;
    }
    if (weight != 0) {
      sum.push_back({index, weight});
    }
  }
  return sum;
}

int64_t DivisorOf(const Terms& terms, int64_t divisor) {
  for (const FlowTerm& term : terms) {
    divisor = std::gcd(divisor, term.weight);
  }
  return divisor;
}

std::optional<Row> Combined(const Row& x, int64_t a, const Row& y, int64_t b) {
  std::optional<Terms> left = Combined(x.left, a, y.left, b);
  std::optional<Terms> made_of = Combined(x.made_of, a, y.made_of, b);
  if (!left || !made_of) {
    return std::nullopt;
  }
  const int64_t divisor = DivisorOf(*left, DivisorOf(*made_of, 0));
  for (Terms* terms : {&*left, &*made_of}) {
    for (FlowTerm& term : *terms) {
      term.weight /= divisor;
    }
  }
  return Row{std::move(*left), std::move(*made_of)};
}

// The combination of both that has nothing at `index`; `x` is taken a positive number of times.
std::optional<Row> Without(uint32_t index, const Row& x, const Row& y) {
  const int64_t of_x = WeightAt(x.left, index);
  const int64_t of_y = WeightAt(y.left, index);
  const int64_t divisor = std::gcd(of_x, of_y);
  const int64_t sign = of_y < 0 ? 1 : -1;  // x is taken |of_y| / divisor times
  return Combined(x, sign * (-of_y / divisor), y, sign * (of_x / divisor));
}

// A row for each place, with the transitions that change it: or the other way round.
std::vector<Row> RowsOf(const Net& net, bool by_place) {
  std::vector<Row> rows(by_place ? net.places.size() : net.transitions.size());
  for (uint32_t t = 0; t < net.transitions.size(); ++t) {
    const auto add = [&](const Arc& arc, int64_t sign) {
      Terms& terms = rows[by_place ? arc.place : t].left;
      const uint32_t index = by_place ? t : arc.place;
      const auto found =
          std::lower_bound(terms.begin(), terms.end(), index,
                           [](const FlowTerm& term, uint32_t at) { return term.index < at; });
      if (found != terms.end() && found->index == index) {
        found->weight += sign * int64_t{arc.weight};
      } else {
        terms.insert(found, {index, sign * int64_t{arc.weight}});
      }
    };
    for (const Arc& arc : net.transitions[t].takes) {
      add(arc, -1);
    }
    for (const Arc& arc : net.transitions[t].gives) {
      add(arc, 1);
    }
  }
  for (uint32_t i = 0; i < rows.size(); ++i) {
    std::erase_if(rows[i].left, [](const FlowTerm& term) { return term.weight == 0; });
    rows[i].made_of = {{i, 1}};
  }
  return rows;
}

bool IsSubset(const Terms& inner, const Terms& outer) {
  return std::includes(outer.begin(), outer.end(), inner.begin(), inner.end(),
                       [](const FlowTerm& a, const FlowTerm& b) { return a.index < b.index; });
}

// Leaves out rows from `first` on whose support contains that of another one; those before are
// minimal. False if that takes too long: then all that are left are rows, but not all of them
// minimal.
bool KeepMinimal(size_t first, std::vector<Row>* rows, size_t* comparisons) {
  std::stable_sort(rows->begin() + static_cast<std::ptrdiff_t>(first), rows->end(),
                   [](const Row& a, const Row& b) { return a.made_of.size() < b.made_of.size(); });
  size_t kept = first;
  for (size_t i = first; i < rows->size(); ++i) {
    Row& row = (*rows)[i];
    if (kept > *comparisons) {
      rows->erase(rows->begin() + static_cast<std::ptrdiff_t>(kept),
                  rows->begin() + static_cast<std::ptrdiff_t>(i));
      return false;
    }
    *comparisons -= kept;
    const auto end = rows->begin() + static_cast<std::ptrdiff_t>(kept);
    if (std::none_of(rows->begin(), end,
                     [&](const Row& other) { return IsSubset(other.made_of, row.made_of); })) {
      if (kept != i) {
        (*rows)[kept] = std::move(row);
      }
      ++kept;
    }
  }
  rows->resize(kept);
  return true;
}

struct Signs {
  size_t positive = 0;
  size_t negative = 0;
};

// The column whose elimination makes the fewest rows; nothing if all are empty.
std::optional<uint32_t> BestColumn(const std::vector<Row>& rows, std::vector<Signs>* signs) {
  std::fill(signs->begin(), signs->end(), Signs());
  for (const Row& row : rows) {
    for (const FlowTerm& term : row.left) {
      ++(term.weight > 0 ? (*signs)[term.index].positive : (*signs)[term.index].negative);
    }
  }
  std::optional<uint32_t> best;
  size_t fewest = 0;
  for (uint32_t column = 0; column < signs->size(); ++column) {
    const auto [positive, negative] = (*signs)[column];
    const size_t made = positive * negative;
    if (positive + negative != 0 && (!best || made < fewest)) {
      best = column;
      fewest = made;
    }
  }
  return best;
}

Semiflows Farkas(std::vector<Row> rows, size_t columns) {
  Semiflows found;
  size_t comparisons = kMaxRowComparisons;
  std::vector<Signs> signs(columns);
  while (const std::optional<uint32_t> column = BestColumn(rows, &signs)) {
    std::vector<Row> next;
    std::vector<const Row*> positive;
    std::vector<const Row*> negative;
    for (const Row& row : rows) {
      const int64_t weight = WeightAt(row.left, *column);
      if (weight == 0) {
        next.push_back(row);
      } else {
        (weight > 0 ? positive : negative).push_back(&row);
      }
    }
    if (next.size() + positive.size() * negative.size() > kMaxRows) {
      found.complete = false;
    }
    const size_t first_new = next.size();
    for (size_t i = 0; i < positive.size() && found.complete; ++i) {
      for (const Row* other : negative) {
        std::optional<Row> row = Without(*column, *positive[i], *other);
        if (!row) {
          found.complete = false;
          break;
        }
        next.push_back(std::move(*row));
      }
    }
    found.complete = found.complete && KeepMinimal(first_new, &next, &comparisons);
    if (!found.complete) {
      // What is free of all columns is a semiflow all the same.
      std::erase_if(next, [](const Row& row) { return !row.left.empty(); });
      rows = std::move(next);
      break;
    }
    rows = std::move(next);
  }
  for (Row& row : rows) {
    found.flows.push_back({std::move(row.made_of)});
  }
  return found;
}

}  // namespace

FlowBasis PlaceInvariants(const Net& net) {
  FlowBasis basis;
  std::vector<Row> rows = RowsOf(net, true);
  for (size_t next = 0; next < rows.size(); ++next) {
    // The row with the fewest terms first: its pivot is the smallest weight.
    const auto shortest = std::min_element(
        rows.begin() + static_cast<std::ptrdiff_t>(next), rows.end(),
        [](const Row& a, const Row& b) {
          const auto rank = [](const Row& row) {
            return row.left.empty() ? std::numeric_limits<size_t>::max() : row.left.size();
          };
          return rank(a) < rank(b);
        });
    if (shortest->left.empty()) {
      break;  // all that are left are invariants
    }
    std::swap(rows[next], *shortest);
    const Row& pivot = rows[next];
    const uint32_t column = std::min_element(pivot.left.begin(), pivot.left.end(),
                                             [](const FlowTerm& a, const FlowTerm& b) {
                                               return std::abs(a.weight) < std::abs(b.weight);
                                             })
                                ->index;
    for (size_t i = next + 1; i < rows.size(); ++i) {
      if (WeightAt(rows[i].left, column) == 0) {
        continue;
      }
      std::optional<Row> row = Without(column, rows[i], pivot);
      if (!row) {
        return {.flows = {}, .complete = false};
      }
      rows[i] = std::move(*row);
    }
  }
  for (Row& row : rows) {
    if (row.left.empty()) {
      basis.flows.push_back({std::move(row.made_of)});
    }
  }
  return basis;
}

Semiflows PlaceSemiflows(const Net& net) {
  return Farkas(RowsOf(net, true), net.transitions.size());
}

Semiflows TransitionSemiflows(const Net& net) {
  return Farkas(RowsOf(net, false), net.places.size());
}

int64_t ValueOf(const Net& net, const Flow& flow) {
  int64_t value = 0;
  for (const FlowTerm& term : flow.terms) {
    int64_t part = 0;
    if (__builtin_mul_overflow(term.weight, int64_t{net.places[term.index].tokens}, &part) ||
        __builtin_add_overflow(value, part, &value)) {
      return std::numeric_limits<int64_t>::max();
    }
  }
  return value;
}

std::vector<uint64_t> BoundsBy(const Net& net, const std::vector<Flow>& semiflows) {
  std::vector<uint64_t> bounds(net.places.size(), kNoBound);
  for (const Flow& flow : semiflows) {
    const int64_t value = ValueOf(net, flow);
    for (const FlowTerm& term : flow.terms) {
      bounds[term.index] = std::min(bounds[term.index], static_cast<uint64_t>(value / term.weight));
    }
  }
  return bounds;
}

}  // namespace pheromone::petri
