// Triangles and convex polygons in PLY, as text and binary (little endian).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "io/base/binary_reader.h"
#include "io/base/text.h"
#include "io/geometry/triangles_builder.h"

namespace lahar {

namespace {

enum class Number : std::uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };

struct NumberName {
  std::string_view name, other;
  Number number;
};
constexpr std::array<NumberName, 8> number_names{{{"char", "int8", Number::i8},
                                                  {"uchar", "uint8", Number::u8},
                                                  {"short", "int16", Number::i16},
                                                  {"ushort", "uint16", Number::u16},
                                                  {"int", "int32", Number::i32},
                                                  {"uint", "uint32", Number::u32},
                                                  {"float", "float32", Number::f32},
                                                  {"double", "float64", Number::f64}}};

struct Property {
  std::string name;
  Number number = Number::f32;
  bool list = false;
  Number count = Number::u8;  ///< of lists
};

struct PlyElement {
  std::string name;
  Index count = 0;
  std::vector<Property> properties;
};

struct PlyHead {
  bool binary = false;
  std::vector<PlyElement> elements;
  Index end = 0;  ///< [bytes] where the data begin
};

class HeadReader {
 public:
  HeadReader(const SideFile& file, ProblemList& problems) : rows_(file, problems) {}

  std::optional<PlyHead> read() {
    std::string_view word;
    if (!rows_.next() || !rows_.word(word, "'ply'")) return std::nullopt;
    if (word != "ply") refuse(fmt::format("a PLY file begins with 'ply', found '{}'", word));
    while (!rows_.failed() && rows_.next() && rows_.word(word, "a keyword")) {
      if (word == "end_header") {
        if (!has_format_) refuse("there is no 'format' row in the head");
        head_.end = rows_.offset();
        return rows_.failed() ? std::nullopt : std::optional(head_);
      }
      read_row(word);
    }
    if (!rows_.failed()) rows_.complain_file("the file ends before 'end_header': it is cut short");
    return std::nullopt;
  }

 private:
  void refuse(std::string message) { rows_.complain(std::move(message)); }

  void read_row(std::string_view keyword) {
    if (keyword == "format")
      read_format();
    else if (keyword == "element")
      read_element();
    else if (keyword == "property")
      read_property();
    else if (keyword != "comment" && keyword != "obj_info")
      refuse(fmt::format("unknown '{}' in the head", keyword));
  }
  void read_format() {
    std::string_view word;
    if (!rows_.word(word, "the format")) return;
    has_format_ = true;
    head_.binary = word == "binary_little_endian";
    if (!head_.binary && word != "ascii")
      refuse(fmt::format("the format must be 'ascii' or 'binary_little_endian', found '{}'", word));
  }
  void read_element() {
    std::string_view word;
    PlyElement& element = head_.elements.emplace_back();
    if (!rows_.word(word, "the name of the element")) return;
    element.name = word;
    rows_.integer(element.count, "the number of elements", 0, std::numeric_limits<Local>::max());
  }
  /// `TYPE NAME` or `list TYPE TYPE NAME`.
  void read_property() {
    Property property;
    std::string_view word;
    if (!rows_.word(word, "the type")) return;
    property.list = word == "list";
    if (property.list && (!rows_.word(word, "the type of the length") ||
                          !number(word, property.count) || !rows_.word(word, "the type")))
      return;
    if (!number(word, property.number) || !rows_.word(word, "the name of the property")) return;
    property.name = word;
    if (head_.elements.empty()) return refuse("a property before the first element");
    head_.elements.back().properties.push_back(property);
  }
  bool number(std::string_view word, Number& to) {
    for (const NumberName& known : number_names)
      if (word == known.name || word == known.other) {
        to = known.number;
        return true;
      }
    refuse(fmt::format("'{}' is not a type of numbers", word));
    return false;
  }

  RowReader rows_;
  PlyHead head_;
  bool has_format_ = false;
};

/// The numbers of the data, one after the other.
class Data {
 public:
  virtual ~Data() = default;
  virtual bool next_row() = 0;
  virtual bool number(Number type, std::string_view what, double& to) = 0;
  virtual bool end_row() = 0;
  /// Says what is wrong with the row; false.
  virtual bool complain(std::string message, std::string hint) = 0;
};

class TextData final : public Data {
 public:
  TextData(const SideFile& file, const PlyHead& head, ProblemList& problems)
      : rows_(file, problems, 0, file.size) {
    while (rows_.offset() < head.end && rows_.next()) {
    }
  }
  bool next_row() override {
    if (rows_.next()) return true;
    rows_.complain_file("the file ends before its last element: it is cut short");
    return false;
  }
  bool number(Number, std::string_view what, double& to) override { return rows_.real(to, what); }
  bool end_row() override { return rows_.end_of_row(); }
  bool complain(std::string message, std::string hint) override {
    rows_.complain(std::move(message), std::move(hint));
    return false;
  }

 private:
  RowReader rows_;
};

class BinaryData final : public Data {
 public:
  BinaryData(const SideFile& file, const PlyHead& head, ProblemList& problems)
      : file_(file), in_(file, head.end), problems_(problems) {}
  bool next_row() override { return true; }
  bool number(Number type, std::string_view what, double& to) override {
    bool got = false;
    switch (type) {
      case Number::i8:
        got = get<std::int8_t>(to);
        break;
      case Number::u8:
        got = get<std::uint8_t>(to);
        break;
      case Number::i16:
        got = get<std::int16_t>(to);
        break;
      case Number::u16:
        got = get<std::uint16_t>(to);
        break;
      case Number::i32:
        got = get<std::int32_t>(to);
        break;
      case Number::u32:
        got = get<std::uint32_t>(to);
        break;
      case Number::f32:
        got = get<float>(to);
        break;
      case Number::f64:
        got = get<double>(to);
        break;
    }
    if (!got) return complain("the file ends before its last element: it is cut short", "");
    if (std::isfinite(to)) return true;
    return complain(fmt::format("{} must be a finite number, found {}", what, to), "");
  }
  bool end_row() override { return true; }
  bool complain(std::string message, std::string hint) override {
    problems_.error({.file = file_.name,
                     .message = fmt::format("at byte {}: {}", in_.offset(), message),
                     .hint = std::move(hint)});
    return false;
  }

 private:
  template <class T>
  bool get(double& to) {
    T value;
    if (!in_.get(value)) return false;
    to = static_cast<double>(value);
    return true;
  }
  const SideFile& file_;
  BinaryReader in_;
  ProblemList& problems_;
};

class BodyReader {
 public:
  BodyReader(Data& data, TrianglesBuilder& to) : data_(data), to_(to) {}

  bool read(const PlyElement& element) {
    const bool vertex = element.name == "vertex", face = element.name == "face";
    if (element.properties.empty()) return true;  // it takes no bytes, whatever its count
    for (Index i = 0; i < element.count; ++i) {
      x_.setZero();
      polygon_.clear();
      if (!data_.next_row()) return false;
      for (const Property& p : element.properties)
        if (!read(p, vertex, face)) return false;
      if (!data_.end_row()) return false;
      if (vertex) vertices_.push_back(to_.point(x_));
      if (face && !add_face(i)) return false;
    }
    return true;
  }

 private:
  bool read(const Property& p, bool vertex, bool face) {
    double value = 0;
    if (!p.list) {
      if (!data_.number(p.number, p.name, value)) return false;
      if (vertex && p.name.size() == 1 && 'x' <= p.name[0] && p.name[0] <= 'z')
        x_[p.name[0] - 'x'] = value;
      return true;
    }
    double count = 0;
    if (!data_.number(p.count, "the length of a list", count)) return false;
    const bool corners = face && (p.name == "vertex_indices" || p.name == "vertex_index");
    if (!(count >= 0 && count <= most_corners && count == std::floor(count)))
      return data_.complain(fmt::format("a list cannot have {} entries", count), "");
    for (int k = 0; k < static_cast<int>(count); ++k) {
      if (!data_.number(p.number, p.name, value)) return false;
      if (!corners) continue;
      if (!(value >= 0 && value < static_cast<double>(vertices_.size()) &&
            value == std::floor(value)))
        return data_.complain(fmt::format("a corner must be one of the {} vertices, found {}",
                                          vertices_.size(), value),
                              "vertices count from 0");
      polygon_.push_back(vertices_[static_cast<std::size_t>(value)]);
    }
    return true;
  }

  bool add_face(Index i) {
    if (polygon_.size() < 3)
      return data_.complain(
          fmt::format("a face needs at least 3 corners, face {} has {}", i, polygon_.size()), "");
    if (!to_.polygon(polygon_))
      return data_.complain(fmt::format("face {} of {} corners is not convex", i, polygon_.size()),
                            "export the surface as triangles");
    return true;
  }

  static constexpr double most_corners = 1 << 16;
  Data& data_;
  TrianglesBuilder& to_;
  Vec<3> x_;
  std::vector<Local> vertices_, polygon_;
};

/// Whether the head has what a surface needs.
bool check_head(const PlyHead& head, const SideFile& file, ProblemList& problems) {
  const auto refuse = [&](std::string message) {
    problems.error({.file = file.name, .message = std::move(message)});
    return false;
  };
  const auto find = [&](std::string_view name) {
    return std::find_if(head.elements.begin(), head.elements.end(),
                        [&](const PlyElement& e) { return e.name == name; });
  };
  const auto has = [](const PlyElement& element, bool list, auto... names) {
    return std::any_of(
        element.properties.begin(), element.properties.end(),
        [&](const Property& p) { return p.list == list && ((p.name == names) || ...); });
  };
  const auto vertex = find("vertex"), face = find("face"), end = head.elements.end();
  if (vertex == end || !has(*vertex, false, "x") || !has(*vertex, false, "y") ||
      !has(*vertex, false, "z"))
    return refuse("the head has no element 'vertex' with x, y and z");
  if (face == end || !has(*face, true, "vertex_indices", "vertex_index"))
    return refuse("the head has no element 'face' with a list 'vertex_indices'");
  for (const auto& element : {vertex, face})
    if (std::any_of(element + 1, end, [&](const PlyElement& e) { return e.name == element->name; }))
      return refuse(fmt::format("the head has two elements '{}'", element->name));
  if (face < vertex) return refuse("faces come before vertices");
  return true;
}

}  // namespace

bool read_ply(const SideFile& file, TrianglesBuilder& to, ProblemList& problems) {
  const auto head = HeadReader(file, problems).read();
  if (!head || !check_head(*head, file, problems)) return false;
  std::unique_ptr<Data> data;
  if (head->binary)
    data = std::make_unique<BinaryData>(file, *head, problems);
  else
    data = std::make_unique<TextData>(file, *head, problems);
  BodyReader body(*data, to);
  return std::all_of(head->elements.begin(), head->elements.end(),
                     [&](const PlyElement& element) { return body.read(element); });
}

}  // namespace lahar
