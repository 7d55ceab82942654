// The same targets for libFuzzer: LAHAR_FUZZ_TARGET=NAME fuzz_coverage CORPUS_FOLDER
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string>

#include "tests/fuzz/mutation.h"
#include "tests/fuzz/targets.h"

namespace {

using namespace lahar::fuzz;

const Target& chosen() {
  static const Target& one = []() -> const Target& {
    const char* name = std::getenv("LAHAR_FUZZ_TARGET");
    return target(name ? name : "scenario");
  }();
  return one;
}

std::vector<std::string> seeds() {
  std::vector<std::string> texts;
  for (const Seed& seed : corpus(chosen())) texts.push_back(seed.text);
  return texts;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static_cast<void>(run(chosen(), {data, size}));
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned seed) {
  static const Mutator mutator;
  static const std::vector<std::string> others = seeds();
  Random random(seed);
  const std::string made =
      mutator.mutate({reinterpret_cast<const char*>(data), size}, chosen().form, others, random);
  const std::size_t bytes = std::min(made.size(), most);
  std::memcpy(data, made.data(), bytes);
  return bytes;
}
