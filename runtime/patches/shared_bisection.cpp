#include "runtime/patches/shared_bisection.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <numeric>

#include "io/mesh/shared_mesh.h"
#include "physics/base/bisection.h"

namespace lahar {

namespace {

using Rules = BisectionRules;

/// Cells in their order along an axis: by position and, where they are level, by id.
struct Place {
  std::uint64_t x;     ///< bits of the position that ascend with it
  std::uint64_t cell;  ///< id
  auto operator<=>(const Place&) const = default;
};

std::uint64_t ascending_bits(double x) {
  const auto bits = std::bit_cast<std::uint64_t>(x + 0.0);  // 0 and -0 are level
  constexpr std::uint64_t sign = std::uint64_t{1} << 63;
  return bits & sign ? ~bits : bits | sign;
}

double position(std::uint64_t bits) {
  constexpr std::uint64_t sign = std::uint64_t{1} << 63;
  return std::bit_cast<double>(bits & sign ? bits & ~sign : ~bits);
}

/// Cells that are cut together; those of this rank are order[begin] to order[end - 1].
struct Piece {
  std::size_t begin, end;
  Index cells;  ///< of all ranks
  Index parts, first_patch;
};

template <int Dim>
class TogetherBisection {
 public:
  TogetherBisection(const Mesh<Dim>& share, Index parts, const Team& team)
      : team_(team), n_cells_(share.n_cells()) {
    const auto [first, end] = own_cells(n_cells_, team);
    first_ = first;
    for (Index cell = first; cell < end; ++cell)
      centre_.push_back(share.cell_centre(cell).cwiseQuotient(share.mean_cell()));
    order_.resize(centre_.size());
    patch_.resize(centre_.size());
    std::iota(order_.begin(), order_.end(), Local{0});
    split({0, order_.size(), n_cells_, parts, 0});
    cut_pieces();
  }
  std::vector<Local> take() { return std::move(patch_); }

 private:
  void split(const Piece& piece) {
    if (piece.parts == 1) {
      for (std::size_t i = piece.begin; i < piece.end; ++i)
        patch_[static_cast<std::size_t>(order_[i])] = static_cast<Local>(piece.first_patch);
      return;
    }
    if (piece.cells * team_.size() <= n_cells_) {
      pieces_.push_back(piece);
      return;
    }
    const int axis = longest_axis(piece);
    const Index middle = Rules::middle(piece.cells, piece.parts);
    const Place place = find(piece, axis, middle);
    const double level = position(place.x);
    const auto is_before = [&](Local i) { return x(i, axis) < level - Rules::same_layer; };
    const auto is_level = [&](Local i) { return x(i, axis) <= level + Rules::same_layer; };
    const Index before = count(piece, is_before), behind = count(piece, is_level);
    const Index cut = Rules::aligned(before, middle, behind, piece.cells);
    const auto own = order_.begin() + static_cast<std::ptrdiff_t>(piece.begin);
    const auto end = order_.begin() + static_cast<std::ptrdiff_t>(piece.end);
    const auto at =
        cut == before ? std::partition(own, end, is_before)
        : cut == behind
            ? std::partition(own, end, is_level)
            : std::partition(own, end, [&](Local i) { return place_of(i, axis) < place; });
    const auto split_at = static_cast<std::size_t>(at - order_.begin());
    const Index left = Rules::first_parts(cut, piece.cells, piece.parts);
    split({piece.begin, split_at, cut, left, piece.first_patch});
    split({split_at, piece.end, piece.cells - cut, piece.parts - left, piece.first_patch + left});
  }

  double x(Local i, int axis) const { return centre_[static_cast<std::size_t>(i)][axis]; }
  Place place_of(Local i, int axis) const {
    return {ascending_bits(x(i, axis)), static_cast<std::uint64_t>(first_ + i)};
  }

  Index count(const Piece& piece, auto&& is_in) const {
    Index n = 0;
    for (std::size_t i = piece.begin; i < piece.end; ++i) n += is_in(order_[i]);
    return team_.sum(n);
  }

  int longest_axis(const Piece& piece) const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    Vec<Dim> low = Vec<Dim>::Constant(infinity), high = -low;
    const auto widen = [&](const Vec<Dim>& from, const Vec<Dim>& to) {
      low = low.cwiseMin(from);
      high = high.cwiseMax(to);
    };
    for (std::size_t i = piece.begin; i < piece.end; ++i) {
      const Vec<Dim>& centre = centre_[static_cast<std::size_t>(order_[i])];
      widen(centre, centre);
    }
    std::vector<double> own(low.data(), low.data() + Dim);
    own.insert(own.end(), high.data(), high.data() + Dim);
    for (const auto& box : team_.gather(own))
      widen(Vec<Dim>(box.data()), Vec<Dim>(box.data() + Dim));
    return Rules::axis<Dim>(low, high);
  }

  /// The place before which there are `rank` of all cells: digit by digit, from the highest.
  Place find(const Piece& piece, int axis, Index rank) const {
    constexpr int bits = 8, digits_of_x = 64 / bits, digits = digits_of_x + 32 / bits;
    constexpr std::size_t values = std::size_t{1} << bits;
    const auto digit = [](const Place& place, int d) {
      return static_cast<std::size_t>(d < digits_of_x ? place.x >> (64 - bits * (d + 1))
                                                      : place.cell >> (96 - bits * (d + 1))) %
             values;
    };
    std::vector<Place> left;  // those that have the digits found so far
    for (std::size_t i = piece.begin; i < piece.end; ++i) left.push_back(place_of(order_[i], axis));
    Place found{0, 0};
    for (int d = 0; d < digits; ++d) {
      std::vector<Index> counts(values, 0);
      for (const Place& place : left) ++counts[digit(place, d)];
      std::vector<Index> all(values, 0);
      for (const auto& of_member : team_.gather(counts))
        for (std::size_t v = 0; v < values; ++v) all[v] += of_member[v];
      std::size_t value = 0;
      while (rank >= all[value]) rank -= all[value++];
      std::erase_if(left, [&](const Place& place) { return digit(place, d) != value; });
      std::uint64_t& number = d < digits_of_x ? found.x : found.cell;
      number = number << bits | value;
    }
    return found;
  }

  struct Sent {
    std::array<double, static_cast<std::size_t>(Dim)> x;
    Index cell;
    Index piece;
  };

  /// The pieces that are left, each on one rank.
  void cut_pieces() {
    const auto members = static_cast<std::size_t>(team_.size());
    std::vector<std::size_t> holder;
    Index all = 0, before = 0;
    for (const Piece& piece : pieces_) all += piece.cells;
    for (const Piece& piece : pieces_) {
      holder.push_back(static_cast<std::size_t>((2 * before + piece.cells) * team_.size() /
                                                std::max<Index>(2 * all, 1)));
      before += piece.cells;
    }
    std::vector<std::vector<Sent>> to(members);
    std::vector<std::vector<Local>> rows(members);
    for (std::size_t p = 0; p < pieces_.size(); ++p)
      for (std::size_t i = pieces_[p].begin; i < pieces_[p].end; ++i) {
        auto& sent = to[holder[p]].emplace_back();
        const auto row = static_cast<std::size_t>(order_[i]);
        std::copy_n(centre_[row].data(), Dim, sent.x.begin());
        sent.cell = first_ + order_[i];
        sent.piece = static_cast<Index>(p);
        rows[holder[p]].push_back(order_[i]);
      }
    centre_ = {};
    order_ = {};
    const auto come = team_.exchange(std::move(to));
    auto replies = cut_own(come);
    replies = team_.exchange(std::move(replies));
    for (std::size_t m = 0; m < members; ++m)
      for (std::size_t i = 0; i < replies[m].size(); ++i)
        patch_[static_cast<std::size_t>(rows[m][i])] = replies[m][i];
  }

  /// The patch of each cell that came.
  std::vector<std::vector<Local>> cut_own(const std::vector<std::vector<Sent>>& come) const {
    struct Cell {
      Index piece, cell;
      std::size_t member, row;
    };
    std::vector<Cell> cells;
    std::vector<std::vector<Local>> patch(come.size());
    for (std::size_t m = 0; m < come.size(); ++m) {
      patch[m].resize(come[m].size());
      for (std::size_t i = 0; i < come[m].size(); ++i)
        cells.push_back({come[m][i].piece, come[m][i].cell, m, i});
    }
    std::sort(cells.begin(), cells.end(), [](const Cell& a, const Cell& b) {
      return a.piece != b.piece ? a.piece < b.piece : a.cell < b.cell;
    });
    for (std::size_t begin = 0, end; begin < cells.size(); begin = end) {
      const Piece& piece = pieces_[static_cast<std::size_t>(cells[begin].piece)];
      end = begin + static_cast<std::size_t>(piece.cells);
      std::vector<Vec<Dim>> centre;
      for (std::size_t i = begin; i < end; ++i)
        centre.emplace_back(come[cells[i].member][cells[i].row].x.data());
      std::vector<Index> first;
      std::vector<Local> order;
      Bisection<Dim>(std::move(centre)).cut(piece.parts, first, order);
      for (std::size_t part = 0; part + 1 < first.size(); ++part)
        for (Index k = first[part]; k < first[part + 1]; ++k) {
          const Cell& cell =
              cells[begin + static_cast<std::size_t>(order[static_cast<std::size_t>(k)])];
          patch[cell.member][cell.row] =
              static_cast<Local>(piece.first_patch + static_cast<Index>(part));
        }
    }
    return patch;
  }

  const Team& team_;
  Index n_cells_;
  Index first_ = 0;               ///< cell of the share
  std::vector<Vec<Dim>> centre_;  ///< [mean cells] of the share's
  std::vector<Local> order_;      ///< rows of the share
  std::vector<Local> patch_;      ///< of the share's cells
  std::vector<Piece> pieces_;
};

}  // namespace

template <int Dim>
std::vector<Local> bisect(const Mesh<Dim>& share, Index parts, const Team& team) {
  return TogetherBisection<Dim>(share, parts, team).take();
}

template std::vector<Local> bisect(const Mesh<2>&, Index, const Team&);
template std::vector<Local> bisect(const Mesh<3>&, Index, const Team&);

}  // namespace lahar
