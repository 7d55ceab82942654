#include "io/scenario/particle_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "io/base/file_part.h"

namespace lahar {

namespace {

// The first row of a file of particles says how many there are; false if it does not (reported).
bool read_count(RowReader& rows, Index& count) {
  if (!rows.next()) {
    rows.complain_file("the file holds no data", "the first row is the number of particles");
    return false;
  }
  return rows.integer(count, "the number of particles", 1) && rows.end_of_row();
}

// The count of the file, or with SideFile::as_cbgeo of its rows; false if there is none (reported).
bool read_count(const SideFile& file, std::string_view what, RowReader& rows, Index& count,
                ProblemList& problems) {
  if (!read_count(rows, count)) return false;
  if (!file.as_cbgeo) return true;
  const Index found = count_rows(file, FilePart(file, rows.offset(), Team()));
  count = rows_to_read(file, what, 1, count, found, problems);
  return true;
}

// A file that starts with a count, as a team sees it before it reads the rows.
struct Counted : TeamRows {
  Counted(const SideFile& file, std::string_view what, const Team& team, ProblemList& problems) {
    see(file, team, [&](RowReader& rows) { return read_count(rows, count); });
    if (part.has_value()) count = rows_to_read(file, what, 1, count, total, problems);
    good = part.has_value() && count == total;
  }
  Index count = 0;  // promised
  bool good = false;
};

// All rows by one reader: calls `expect(count)`, then `take(x)` for each.
template <int Dim>
bool read_points(const SideFile& file, ProblemList& problems, auto&& expect, auto&& take) {
  RowReader rows(file, problems);
  Index count = 0;
  if (!read_count(file, "particles", rows, count, problems)) return false;
  expect(count);
  for (Index i = 0; i < count; ++i) {
    if (!rows.next()) {
      too_few(rows, "particles", i, count);
      return false;
    }
    Vec<Dim> x = Vec<Dim>::Zero();
    read_point<Dim>(rows, x);
    take(x);
  }
  no_more_rows(rows, "particles", count);
  return !rows.failed();
}

}  // namespace

template <int Dim>
std::optional<std::vector<Vec<Dim>>> read_particle_file(const SideFile& file, const Team& team,
                                                        ProblemList& problems) {
  std::vector<Vec<Dim>> points;
  if (team.alone()) {
    const auto expect = [&](Index n) {
      if (plausible(file, n)) points.reserve(static_cast<std::size_t>(n));
    };
    const auto take = [&](const Vec<Dim>& x) { points.push_back(x); };
    if (!read_points<Dim>(file, problems, expect, take)) return std::nullopt;
    return points;
  }
  const Counted counted(file, "particles", team, problems);
  bool good = counted.good;
  if (good)
    all_or_none(team, [&] {
      ProblemList none;
      RowReader rows(file, none, counted.part->begin, counted.part->end);
      points.reserve(static_cast<std::size_t>(counted.own));
      while (good && rows.next()) good = read_point<Dim>(rows, points.emplace_back());
    });
  if (!team.any(!good)) return points;
  explain(file, team, problems, [&](ProblemList& found) {
    read_points<Dim>(
        file, found, [](Index) {}, [](const Vec<Dim>&) {});
  });
  return std::nullopt;
}

namespace {

// What a row says of one particle.
template <class T>
struct Entry {
  Index particle;
  T value;
};

// Read this member's part of a file and send each row to the member that has its particle, some at
// a time. `parse(rows, i)` makes an entry of the i-th row of the part, or nothing if it is wrong;
// `take(local, value)` says whether it may be. False if anything is wrong anywhere.
template <class T>
bool read_together(const SideFile& file, const FilePart& part, const RowShares& shares,
                   const Team& team, auto&& parse, auto&& take) {
  constexpr int at_a_time = 1 << 15;
  ProblemList none;
  RowReader rows(file, none, part.begin, part.end);
  Index i = 0;
  bool good = true, more = true;
  while (team.any(more)) {
    std::vector<std::vector<Entry<T>>> to(static_cast<std::size_t>(team.size()));
    all_or_none(team, [&] {
      for (int n = 0; more && n < at_a_time; ++n) {
        more = rows.next();
        if (!more) break;
        const std::optional<Entry<T>> entry = parse(rows, i++);
        if (!entry) good = more = false;
        if (entry)
          to[static_cast<std::size_t>(shares.member(entry->particle))].push_back(
              {shares.local(entry->particle), entry->value});
      }
    });
    for (const auto& from : team.exchange(std::move(to)))
      for (const Entry<T>& entry : from) good = take(entry.particle, entry.value) && good;
  }
  return !team.any(!good);
}

bool read_stress(RowReader& rows, Voigt& stress) {
  constexpr std::string_view names[] = {"xx", "yy", "zz", "xy", "yz", "xz"};
  for (std::size_t c = 0; c < 6; ++c)
    if (!rows.real(stress[c], names[c])) return false;
  return rows.end_of_row();
}

bool read_stresses(const SideFile& file, Index n_particles, ProblemList& problems,
                   const Take<Voigt>& take) {
  RowReader rows(file, problems);
  Index count = 0;
  if (!read_count(file, "rows of stresses", rows, count, problems)) return false;
  const bool fits = n_particles < 0 || count == n_particles;
  if (!fits)
    rows.complain(
        fmt::format("the file has stresses of {} particles, but there are {}", count, n_particles));
  for (Index i = 0; i < count; ++i) {
    if (!rows.next()) {
      too_few(rows, "rows of stresses", i, count);
      return false;
    }
    Voigt stress{};
    read_stress(rows, stress);
    if (fits) take(i, stress);
  }
  no_more_rows(rows, "rows of stresses", count);
  return !rows.failed();
}

// Nothing is done with what is only checked.
const auto unused = [](Index, const auto&) {};

}  // namespace

bool read_stress_file(const SideFile& file, const RowShares* shares, const Team& team,
                      ProblemList& problems, const Take<Voigt>& take) {
  if (shares && team.alone()) return read_stresses(file, shares->total(), problems, take);
  if (shares) {
    const Counted counted(file, "rows of stresses", team, problems);
    const auto parse = [&](RowReader& rows, Index i) -> std::optional<Entry<Voigt>> {
      Entry<Voigt> entry{counted.first + i, {}};
      if (!read_stress(rows, entry.value)) return std::nullopt;
      return entry;
    };
    const auto keep = [&](Index local, const Voigt& value) {
      take(local, value);
      return true;
    };
    if (counted.good && counted.count == shares->total() &&
        read_together<Voigt>(file, *counted.part, *shares, team, parse, keep))
      return true;
  }
  const Index n = shares ? shares->total() : -1;
  const auto read = [&](ProblemList& found) { read_stresses(file, n, found, unused); };
  if (shares)
    explain(file, team, problems, read);
  else
    by_the_first(team, problems, read);
  return false;
}

namespace {

// Complains where `id` was seen before.
class Once {
 public:
  bool operator()(RowReader& rows, Index id) {
    if (static_cast<std::size_t>(id) >= line_.size())
      line_.resize(static_cast<std::size_t>(id) + 1);
    int& line = line_[static_cast<std::size_t>(id)];
    if (line == 0) {
      line = rows.line();
      return true;
    }
    rows.complain(fmt::format("particle {} occurs twice; first on line {}", id, line));
    return false;
  }

 private:
  std::vector<int> line_;
};

// A file of rows `particle value`; `read_value(rows, value)` reads the rest of a row.
template <class T>
bool read_values(const SideFile& file, const RowShares* shares, const Team& team,
                 ProblemList& problems, auto&& read_value, const Take<T>& take) {
  const Index n = shares ? shares->total() : -1;
  const auto read_all = [&](ProblemList& found, auto&& use) {
    RowReader rows(file, found);
    Once once;
    while (rows.next()) {
      Entry<T> entry{};
      if (!rows.integer(entry.particle, "a particle id", 0, last_id(n))) continue;
      if (n >= 0 && !once(rows, entry.particle)) continue;
      if (read_value(rows, entry.value)) use(entry.particle, entry.value);
    }
    return !rows.failed();
  };
  if (shares && team.alone()) return read_all(problems, take);
  if (shares) {
    std::vector<char> seen(static_cast<std::size_t>(shares->own()), 0);
    const auto parse = [&](RowReader& rows, Index) -> std::optional<Entry<T>> {
      Entry<T> entry{};
      if (!rows.integer(entry.particle, "a particle id", 0, last_id(n)) ||
          !read_value(rows, entry.value))
        return std::nullopt;
      return entry;
    };
    const auto keep = [&](Index local, const T& value) {
      take(local, value);
      return !std::exchange(seen[static_cast<std::size_t>(local)], 1);
    };
    std::optional<FilePart> part;
    all_or_none(team, [&] { part.emplace(file, 0, team); });
    if (read_together<T>(file, *part, *shares, team, parse, keep)) return true;
  }
  const auto read = [&](ProblemList& found) { read_all(found, unused); };
  if (shares)
    explain(file, team, problems, read);
  else
    by_the_first(team, problems, read);
  return false;
}

}  // namespace

bool read_volume_file(const SideFile& file, const RowShares* shares, const Team& team,
                      ProblemList& problems, const Take<double>& take) {
  const auto read_volume = [](RowReader& rows, double& volume) {
    if (!rows.real(volume, "the volume")) return false;
    if (volume > 0) return rows.end_of_row();
    rows.complain(fmt::format("the volume must be greater than 0, found {}", volume));
    return false;
  };
  return read_values<double>(file, shares, team, problems, read_volume, take);
}

bool read_particle_values(const SideFile& file, std::string_view what, const RowShares* shares,
                          const Team& team, ProblemList& problems, const Take<double>& take) {
  const auto read_value = [&](RowReader& rows, double& value) {
    return rows.real(value, what) && rows.end_of_row();
  };
  return read_values<double>(file, shares, team, problems, read_value, take);
}

bool read_particle_cell_file(const SideFile& file, const RowShares* shares, Index n_cells,
                             const Team& team, ProblemList& problems, const Take<Index>& take) {
  const auto read_cell = [&](RowReader& rows, Index& cell) {
    return rows.integer(cell, "a cell id", 0, last_id(n_cells)) && rows.end_of_row();
  };
  return read_values<Index>(file, shares, team, problems, read_cell, take);
}

template std::optional<std::vector<Vec<2>>> read_particle_file<2>(const SideFile&, const Team&,
                                                                  ProblemList&);
template std::optional<std::vector<Vec<3>>> read_particle_file<3>(const SideFile&, const Team&,
                                                                  ProblemList&);

}  // namespace lahar
