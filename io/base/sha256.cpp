#include "io/base/sha256.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>

#include "io/base/atomic_file.h"

namespace lahar {

namespace {

using Words8 = std::array<std::uint32_t, 8>;
using Words64 = std::array<std::uint32_t, 64>;

/// First 32 bits of the fractional part. The radicands are below 312, so that a long double
/// (64-bit significand) has bits to spare.
std::uint32_t fraction_bits(long double value) {
  return static_cast<std::uint32_t>(std::ldexp(value - std::floor(value), 32));
}

/// The standard's constants: roots of the first primes.
struct Constants {
  Words8 start;   // square roots of the first 8
  Words64 round;  // cube roots of the first 64
  Constants() {
    std::size_t count = 0;
    for (int candidate = 2; count < round.size(); ++candidate) {
      bool prime = true;
      for (int d = 2; d * d <= candidate; ++d) prime = prime && candidate % d != 0;
      if (!prime) continue;
      if (count < start.size()) start[count] = fraction_bits(std::sqrt((long double)candidate));
      round[count++] = fraction_bits(std::cbrt((long double)candidate));
    }
  }
};

void compress(Words8& hash, const unsigned char* block, const Words64& k) {
  Words64 w;
  for (int t = 0; t < 16; ++t)
    w[t] = std::uint32_t{block[4 * t]} << 24 | std::uint32_t{block[4 * t + 1]} << 16 |
           std::uint32_t{block[4 * t + 2]} << 8 | std::uint32_t{block[4 * t + 3]};
  for (int t = 16; t < 64; ++t) {
    const std::uint32_t a = w[t - 15], b = w[t - 2];
    const std::uint32_t s0 = std::rotr(a, 7) ^ std::rotr(a, 18) ^ (a >> 3);
    const std::uint32_t s1 = std::rotr(b, 17) ^ std::rotr(b, 19) ^ (b >> 10);
    w[t] = w[t - 16] + s0 + w[t - 7] + s1;
  }
  auto [a, b, c, d, e, f, g, h] = hash;
  for (int t = 0; t < 64; ++t) {
    const std::uint32_t S1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
    const std::uint32_t t1 = h + S1 + ((e & f) ^ (~e & g)) + k[t] + w[t];
    const std::uint32_t S0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
    const std::uint32_t t2 = S0 + ((a & b) ^ (a & c) ^ (b & c));
    h = g, g = f, f = e, e = d + t1;
    d = c, c = b, b = a, a = t1 + t2;
  }
  const Words8 sum{a, b, c, d, e, f, g, h};
  for (int i = 0; i < 8; ++i) hash[i] += sum[i];
}

/// The hash of a text that comes in pieces.
class Digest {
 public:
  /// Whole blocks of 64 bytes; what is behind them is left.
  void add(std::string_view& text) {
    for (; text.size() >= 64; text.remove_prefix(64)) {
      compress(hash_, reinterpret_cast<const unsigned char*>(text.data()), constants().round);
      size_ += 64;
    }
  }

  /// The last piece: the rest, a one bit, zeros, and the length in bits.
  std::string finish(std::string_view text) {
    add(text);
    std::array<unsigned char, 128> tail{};
    std::copy(text.begin(), text.end(), tail.begin());
    tail[text.size()] = 0x80;
    const std::size_t size = text.size() < 56 ? 64 : 128;
    for (int i = 0; i < 8; ++i)
      tail[size - 1 - i] = static_cast<unsigned char>((size_ + text.size()) * 8 >> (8 * i));
    for (std::size_t i = 0; i < size; i += 64) compress(hash_, tail.data() + i, constants().round);
    std::string digits;
    for (const std::uint32_t word : hash_)
      for (int shift = 28; shift >= 0; shift -= 4) digits += "0123456789abcdef"[word >> shift & 15];
    return digits;
  }

 private:
  static const Constants& constants() {
    static const Constants constants;
    return constants;
  }
  Words8 hash_ = constants().start;
  std::uint64_t size_ = 0;
};

}  // namespace

std::string sha256(std::string_view text) {
  return Digest().finish(text);
}

std::string sha256_of_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string piece(std::size_t{1} << 20, '\0');
  Digest digest;
  while (in.read(piece.data(), static_cast<std::streamsize>(piece.size()))) {
    std::string_view whole = piece;
    digest.add(whole);
  }
  if (!in.eof()) return sha256(read_text_file(file));  // says why not
  return digest.finish({piece.data(), static_cast<std::size_t>(in.gcount())});
}

}  // namespace lahar
