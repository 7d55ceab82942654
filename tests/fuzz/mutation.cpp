#include "tests/fuzz/mutation.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <limits>

#include "tests/fuzz/mutation_values.h"
#include "tests/fuzz/sections.h"

namespace lahar::fuzz {

std::string Mutator::mutate(const std::string& input, Form form,
                            const std::vector<std::string>& others, Random& random) const {
  const std::string& other = others.empty() ? input : any_of(others, random);
  std::string made = input;
  for (std::size_t k = 0, n = one_in(4, random) ? 1 + below(8, random) : 1; k < n; ++k) {
    if (form == Form::bundle)
      made = mutate_bundle(made, other, random);
    else if (form == Form::sections && !one_in(16, random))
      made = mutate_sections(made, other, random);
    else if (form == Form::formats)
      made = mutate_formats(made, other, random);
    else if (form == Form::bytes && one_in(2, random))
      made = mutate_text(std::move(made), random);
    else
      made = mutate_bytes(std::move(made), random);
  }
  return made;
}

std::string Mutator::mutate_bundle(const std::string& input, const std::string& other,
                                   Random& random) const {
  std::vector<BundledFile> files = unbundle(input);
  const std::size_t at = one_in(2, random) ? 0 : below(files.size(), random);
  std::string& text = files[at].text;
  const bool json = at == 0 || text.starts_with("{");
  if (json && !one_in(8, random))
    text = mutate_json(text, unbundle(other).front().text, random);
  else if (one_in(3, random))
    text = mutate_bytes(std::move(text), random);
  else
    text = mutate_text(std::move(text), random);
  return bundle(files);
}

/// JSON as such, records by their words; sections go, come twice or change places.
std::string Mutator::mutate_sections(const std::string& input, const std::string& other,
                                     Random& random) const {
  std::vector<SectionedFile> files = split_sections(input);
  if (files.empty()) return mutate_bytes(input, random);
  SectionedFile& file = any_of(files, random);
  if (file.empty()) return mutate_bytes(input, random);
  Section& section = any_of(file, random);
  const std::vector<SectionedFile> lenders = split_sections(other);
  switch (below(24, random)) {
    case 0:
      file.erase(file.begin() + (&section - file.data()));
      break;
    case 1:
      file.push_back(Section(section));
      break;
    case 2:
      std::swap(section, any_of(file, random));
      break;
    case 3:
      if (!lenders.empty())
        if (const SectionedFile& lender = any_of(lenders, random); !lender.empty())
          section = any_of(lender, random);
      break;
    case 4:
      section.kind = static_cast<TraceSection::Kind>(below(6, random));
      break;
    case 5:
      if (files.size() < 4) files.push_back(SectionedFile(file));
      break;
    default:
      if (section.kind == TraceSection::Kind::records) {
        section.bytes = mutate_words(std::move(section.bytes), random);
      } else {
        std::string lent = section.bytes;
        for (const SectionedFile& lender : lenders)
          for (const Section& one : lender)
            if (one.kind == section.kind) lent = one.bytes;
        section.bytes = mutate_json(section.bytes, lent, random);
      }
  }
  return join_sections(files);
}

/// A number of 1 to 8 bytes becomes another, at an address that is a multiple of its size; records
/// change places.
std::string Mutator::mutate_words(std::string text, Random& random) const {
  if (text.size() < 16 || one_in(8, random)) return mutate_bytes(std::move(text), random);
  const std::size_t size = std::size_t{1} << below(4, random);
  const auto place = [&] { return below(text.size() / size, random) * size; };
  const std::size_t at = place();
  std::uint64_t value = 0;
  std::memcpy(&value, text.data() + at, size);
  switch (below(8, random)) {
    case 0:
      value = static_cast<std::uint64_t>(any_of(integers, random));
      break;
    case 1:
      value += 1;
      break;
    case 2:
      value -= 1;
      break;
    case 3:
      value ^= std::uint64_t{1} << below(8 * size, random);
      break;
    case 4:
      std::memcpy(&value, text.data() + place(), size);
      break;
    case 5: {
      const double real =
          one_in(4, random) ? std::numeric_limits<double>::quiet_NaN() : any_of(doubles, random);
      if (size == 8) std::memcpy(&value, &real, size);
      break;
    }
    case 6: {
      constexpr std::size_t record = sizeof(TraceRecord);
      if (text.size() < 2 * record) break;
      const std::size_t a = below(text.size() / record, random) * record,
                        b = below(text.size() / record, random) * record;
      std::swap_ranges(
          text.begin() + static_cast<std::ptrdiff_t>(a),
          text.begin() + static_cast<std::ptrdiff_t>(std::min(a + record, text.size())),
          text.begin() + static_cast<std::ptrdiff_t>(b));
      return text;
    }
    default:
      value = random();
  }
  std::memcpy(text.data() + at, &value, size);
  return text;
}

/// Words and lines: a number becomes another, a line goes or comes twice.
std::string Mutator::mutate_text(std::string text, Random& random) const {
  if (text.empty()) return any_of(texts, random);
  const std::size_t at = below(text.size(), random);
  switch (below(4, random)) {
    case 0: {
      std::size_t begin = at, end = at;
      const auto in_word = [&](std::size_t i) {
        return std::isspace(static_cast<unsigned char>(text[i])) == 0 && text[i] != ',';
      };
      while (begin > 0 && in_word(begin - 1)) --begin;
      while (end < text.size() && in_word(end)) ++end;
      const std::string word = one_in(2, random)   ? Json(any_of(doubles, random)).dump()
                               : one_in(2, random) ? std::to_string(any_of(integers, random))
                               : one_in(2, random) ? "nan"
                                                   : any_of(texts, random);
      return text.replace(begin, end - begin, word);
    }
    case 1: {
      const std::size_t begin = text.rfind('\n', at) + 1,
                        end = std::min(text.find('\n', at), text.size() - 1) + 1;
      return begin < end ? text.erase(begin, end - begin) : text;
    }
    case 2: {
      const std::size_t begin = text.rfind('\n', at) + 1,
                        end = std::min(text.find('\n', at), text.size() - 1) + 1;
      return begin < end ? text.insert(begin, text.substr(begin, end - begin)) : text;
    }
    default:
      return text.substr(0, at);
  }
}

std::string Mutator::mutate_bytes(std::string text, Random& random) const {
  if (text.empty()) return std::string(1, static_cast<char>(random()));
  const std::size_t at = below(text.size(), random);
  if (one_in(200, random)) {  // something within itself, many times
    const std::string part = one_in(2, random) ? "[" : text.substr(at, 1 + below(8, random));
    std::string many;
    for (std::size_t k = 0, n = std::size_t{1} << below(17, random); k < n; ++k) many += part;
    return text.insert(at, many);
  }
  switch (below(5, random)) {
    case 0:
      text[at] = static_cast<char>(random());
      break;
    case 1:
      text[at] = static_cast<char>(text[at] ^ (1 << below(8, random)));
      break;
    case 2:
      text.erase(at, 1 + below(8, random));
      break;
    case 3: {  // an integer of a binary file
      const std::int64_t value = any_of(integers, random);
      const std::size_t bytes =
          std::min<std::size_t>(std::size_t{1} << below(4, random), text.size() - at);
      text.replace(at, bytes, reinterpret_cast<const char*>(&value), bytes);
      break;
    }
    default:
      text.insert(at, text.substr(below(text.size(), random), 1 + below(16, random)));
  }
  return text;
}

}  // namespace lahar::fuzz
