#include "physics/particles/particles.h"

#if defined(__linux__)
#include <sys/mman.h>
#include <unistd.h>
#endif

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>

namespace lahar {

namespace {

/// Doubles that a kernel may read beyond the last particle: one vector of the widest kind.
constexpr std::size_t padding = 8;
constexpr std::size_t line = 8;  ///< doubles in a cache line

/// Rows start on cache lines, and consecutive rows on different sets: a stride that is a multiple
/// of a page would map all columns of a particle to one set of the first-level cache.
std::size_t stride_for(std::size_t capacity) {
  std::size_t stride = (capacity + padding + line - 1) / line * line;
  if (stride % 64 == 0) stride += line;
  return stride;
}

/// Ask for pages of 2 MiB. A kernel goes along some thirty rows at once, each in pages of its own:
/// with small ones it waits for address translation. Blocks that follow each other share large
/// pages, so smaller ones gain as well. A wish that the system may ignore.
void ask_for_large_pages([[maybe_unused]] void* memory, [[maybe_unused]] std::size_t bytes) {
#if defined(__linux__)
  constexpr std::size_t worthwhile = 1 << 18;
  if (bytes < worthwhile) return;
  static const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto begin = (reinterpret_cast<std::uintptr_t>(memory) + page - 1) / page * page;
  const auto end = (reinterpret_cast<std::uintptr_t>(memory) + bytes) / page * page;
  madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#endif
}

}  // namespace

template <int Dim>
void Particles<Dim>::Free::operator()(double*) const {
  std::free(memory);
}

template <int Dim>
Particles<Dim>::Particles(ColumnLayout<Dim> layout) : layout_(layout) {}

/// Zeros that the system has at hand take no memory and no time before they are written to.
template <int Dim>
typename Particles<Dim>::Block Particles<Dim>::allocate_zeros(std::size_t bytes) {
  std::size_t space = bytes + line * sizeof(double);
  void* memory = std::calloc(space, 1);
  if (!memory) throw std::bad_alloc();
  ask_for_large_pages(memory, space);
  void* aligned = memory;
  std::align(line * sizeof(double), bytes, aligned, space);
  return Block(static_cast<double*>(aligned), Free{memory});
}

template <int Dim>
void Particles<Dim>::reserve(Local capacity) {
  if (capacity <= capacity_) return;
  const std::size_t stride = stride_for(static_cast<std::size_t>(capacity));
  const std::size_t bytes = stride * static_cast<std::size_t>(layout_.rows()) * sizeof(double);
  Block block = allocate_zeros(bytes);
  for (int r = 0; r < layout_.rows() && size_ > 0; ++r)
    std::copy_n(block_.get() + static_cast<std::size_t>(r) * stride_, size_,
                block.get() + static_cast<std::size_t>(r) * stride);
  block_ = std::move(block);
  touched_ = size_;
  stride_ = stride;
  capacity_ = capacity;
  id.reserve(static_cast<std::size_t>(capacity));
  cell.reserve(static_cast<std::size_t>(capacity));
  material.reserve(static_cast<std::size_t>(capacity));
}

template <int Dim>
void Particles<Dim>::resize(Local size) {
  if (size > capacity_) reserve(std::max(size, capacity_ + capacity_ / 8 + 8));
  // What was never used is zero already.
  if (const Local used = std::min(size, touched_); used > size_)
    for (int r = 0; r < layout_.rows(); ++r)
      std::fill_n(block_.get() + static_cast<std::size_t>(r) * stride_ + size_, used - size_, 0.0);
  touched_ = std::max(touched_, size);
  id.resize(static_cast<std::size_t>(size));
  cell.resize(static_cast<std::size_t>(size));
  material.resize(static_cast<std::size_t>(size));
  if (!loads.empty() || size == 0) loads.resize(loads.empty() ? 0 : static_cast<std::size_t>(size));
  size_ = size;
}

template <int Dim>
void Particles<Dim>::copy(std::span<const SlotCopy> copies, const Particles& other) {
  if (copies.empty()) return;
  for (int r = 0; r < layout_.rows(); ++r) {
    const double* from = other.block_.get() + static_cast<std::size_t>(r) * other.stride_;
    double* to = block_.get() + static_cast<std::size_t>(r) * stride_;
    for (const SlotCopy& one : copies) to[one.to] = from[one.from];
  }
  const auto apply = [&](const auto& from, auto& to) {
    for (const SlotCopy& one : copies)
      to[static_cast<std::size_t>(one.to)] = from[static_cast<std::size_t>(one.from)];
  };
  apply(other.id, id);
  apply(other.cell, cell);
  apply(other.material, material);
  if (loads.empty() && other.loads.empty()) return;
  loads.resize(static_cast<std::size_t>(size_));
  if (other.loads.empty())  // none of its particles has loads: who was in the slot before may have
    for (const SlotCopy& one : copies) loads[static_cast<std::size_t>(one.to)] = 0;
  else
    apply(other.loads, loads);
}

template <int Dim>
Local Particles<Dim>::add_slot() {
  const Local at = size_;
  if (at == capacity_) reserve(std::max<Local>(16, 2 * capacity_));
  touched_ = std::max(touched_, ++size_);
  id.resize(static_cast<std::size_t>(size_));
  cell.resize(static_cast<std::size_t>(size_));
  material.resize(static_cast<std::size_t>(size_));
  if (!loads.empty()) loads.resize(static_cast<std::size_t>(size_));
  return at;
}

template <int Dim>
void Particles<Dim>::append(const Particles& other, Local i) {
  const SlotCopy one{i, add_slot()};
  copy({&one, 1}, other);
}

template <int Dim>
void Particles<Dim>::get(Local i, double* rows) const {
  for (int r = 0; r < layout_.rows(); ++r)
    rows[r] = block_.get()[static_cast<std::size_t>(r) * stride_ + static_cast<std::size_t>(i)];
}

template <int Dim>
void Particles<Dim>::append(const double* rows, Index particle_id, std::uint16_t particle_material,
                            std::uint64_t particle_loads) {
  const auto at = static_cast<std::size_t>(add_slot());
  for (int r = 0; r < layout_.rows(); ++r)
    block_.get()[static_cast<std::size_t>(r) * stride_ + at] = rows[r];
  id[at] = particle_id;
  material[at] = particle_material;
  if (particle_loads == 0 && loads.empty()) return;
  loads.resize(static_cast<std::size_t>(size_));
  loads[at] = particle_loads;
}

template <int Dim>
void Particles<Dim>::rearrange(std::span<const SlotMove> moves, Local slots) {
  if (slots > capacity_) reserve(slots + slots / 16);
  const auto n = static_cast<std::size_t>(slots);
  std::vector<double> scratch(n + padding);
  for (int r = 0; r < layout_.rows(); ++r) {
    double* row = block_.get() + static_cast<std::size_t>(r) * stride_;
    // Whole vectors: what is copied too much is overwritten by the next move.
    for (const SlotMove& move : moves)
      for (Local k = 0; k < move.n; k += static_cast<Local>(padding))
        std::memcpy(scratch.data() + move.to + k, row + move.from + k, padding * sizeof(double));
    std::copy_n(scratch.data(), n, row);
  }
  const auto apply = [&](auto& values) {
    std::decay_t<decltype(values)> old(n);
    for (const SlotMove& move : moves)
      std::copy_n(values.begin() + move.from, move.n, old.begin() + move.to);
    values.swap(old);
  };
  apply(id);
  apply(cell);
  apply(material);
  if (!loads.empty()) apply(loads);
  size_ = slots;
  touched_ = std::max(touched_, slots);
}

template <int Dim>
std::size_t Particles<Dim>::bytes() const {
  return stride_ * static_cast<std::size_t>(layout_.rows()) * sizeof(double) +
         id.capacity() * sizeof(Index) + cell.capacity() * sizeof(Local) +
         material.capacity() * sizeof(std::uint16_t) + loads.capacity() * sizeof(std::uint64_t);
}

template class Particles<2>;
template class Particles<3>;

}  // namespace lahar
