// The tags of a VTU file.
#include <fmt/format.h>

#include <charconv>

#include "io/mesh/vtu_arrays.h"

namespace lahar {

namespace {

struct Tag {
  std::string name;  ///< "/Name" where it ends
  bool empty = false;
  std::map<std::string, std::string> attributes;
  Index begin = 0, end = 0;  ///< [bytes] of the tag itself
};

/// The tags of a file, one after the other.
class Tags {
 public:
  explicit Tags(const SideFile& file) : file_(file), in_(file) {}

  /// False at the end of the file.
  bool next(Tag& tag) {
    while (true) {
      const Index opened = find('<');
      if (opened < 0) return false;
      tag = {};
      tag.begin = opened - 1;
      const std::string text = rest_of_tag();
      if (text == comment) {
        if (!skip_comment()) return false;
        continue;
      }
      tag.end = in_.offset();
      parse(text, tag);
      return true;
    }
  }
  /// Where the file goes on behind the next `wanted`; -1 if there is none.
  Index find(char wanted) {
    char c;
    while (in_.get(c))
      if (c == wanted) return in_.offset();
    return -1;
  }

 private:
  static constexpr std::string_view comment = "!--";
  /// From behind "<" to before ">", which quotes may hold, too; of a comment its beginning.
  std::string rest_of_tag() {
    std::string text;
    char quote = 0, c;
    while (true) {
      if (!in_.get(c) || text.size() > longest)
        fail_vtu(file_, fmt::format("the file ends within a tag, '<{}': it is cut short",
                                    text.substr(0, 20)));
      if (c == '>' && quote == 0) return text;
      if (c == quote)
        quote = 0;
      else if (quote == 0 && (c == '"' || c == '\''))
        quote = c;
      text += c;
      if (text == comment) return text;
    }
  }
  bool skip_comment() {
    std::string last;
    char c;
    while (in_.get(c)) {
      last = (last + c).substr(last.size() < 3 ? 0 : 1);
      if (last == "-->") return true;
    }
    return false;
  }
  static void parse(const std::string& text, Tag& tag) {
    constexpr std::string_view blanks = " \t\r\n";
    tag.empty = text.ends_with('/');
    auto at = std::min(text.find_first_of(blanks), text.size());
    tag.name = text.substr(0, at);
    if (tag.name.size() > 1 && tag.name.back() == '/') tag.name.pop_back();
    while (true) {
      at = text.find_first_not_of(blanks, at);
      const auto equal = text.find('=', at);
      if (at == text.npos || equal == text.npos) return;
      const auto open = text.find_first_of("\"'", equal);
      if (open == text.npos) return;
      const auto close = text.find(text[open], open + 1);
      if (close == text.npos) return;
      auto key = text.substr(at, equal - at);
      key.erase(std::min(key.find_last_not_of(blanks) + 1, key.size()));
      tag.attributes[key] = text.substr(open + 1, close - open - 1);
      at = close + 1;
    }
  }

  static constexpr std::size_t longest = 1 << 16;
  const SideFile& file_;
  BinaryReader in_;
};

class HeadReader {
 public:
  explicit HeadReader(const SideFile& file) : file_(file), tags_(file) {}

  VtuHead read() {
    Tag tag;
    while (head_.appended < 0 && tags_.next(tag)) {
      if (tag.name == "VTKFile") read_file(tag);
      if (tag.name == "Piece") read_piece(tag);
      if (tag.name == "DataArray") add_array(tag);
      if (tag.name == "AppendedData") {
        head_.appended_base64 = tag.attributes["encoding"] == "base64";
        head_.appended = tags_.find('_');
      }
      if (tag.name == "Points" || tag.name == "Cells" || tag.name == "PointData" ||
          tag.name == "CellData")
        section_ = tag.empty ? "" : tag.name;
      if (tag.name == "/VTKFile") ended_ = true;
    }
    if (head_.n_points < 0 || (!ended_ && head_.appended < 0))
      fail_vtu(file_, "the file ends before </VTKFile>: it is cut short");
    return std::move(head_);
  }

 private:
  Index integer(const std::string& text, std::string_view what) const {
    Index value = -1;
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || rest != text.data() + text.size() || value < 0)
      fail_vtu(file_, fmt::format("{} must be a non-negative integer, found '{}'", what,
                                  text.substr(0, 40)));
    return value;
  }
  void read_file(Tag& tag) {
    if (tag.attributes["type"] != "UnstructuredGrid")
      fail_vtu(
          file_,
          fmt::format("the file must have an UnstructuredGrid, found '{}'", tag.attributes["type"]),
          "save it as .vtu");
    if (tag.attributes["byte_order"] == "BigEndian")
      fail_vtu(file_, "the byte order must be LittleEndian, found 'BigEndian'");
    head_.wide = tag.attributes["header_type"] == "UInt64";
    const std::string& compressor = tag.attributes["compressor"];
    head_.compressed = !compressor.empty();
    if (head_.compressed && compressor != "vtkZLibDataCompressor")
      fail_vtu(file_, fmt::format("arrays compressed by {} are not read", compressor),
               "save it compressed by ZLib, or not compressed");
  }
  void read_piece(Tag& tag) {
    if (head_.n_points >= 0)
      fail_vtu(file_, "the grid has several pieces", "merge them to one before saving");
    head_.n_points = integer(tag.attributes["NumberOfPoints"], "NumberOfPoints");
    head_.n_cells = integer(tag.attributes["NumberOfCells"], "NumberOfCells");
  }
  void add_array(Tag& tag) {
    VtuArray array{.name = tag.attributes["Name"],
                   .type = tag.attributes["type"],
                   .format = tag.attributes["format"]};
    if (array.format.empty()) array.format = "ascii";
    if (const std::string& n = tag.attributes["NumberOfComponents"]; !n.empty())
      array.components = integer(n, "NumberOfComponents");
    array.begin = array.end = tag.end;
    if (array.format == "appended") array.offset = integer(tag.attributes["offset"], "offset");
    if (!tag.empty && array.format != "appended") {
      Tag end;
      while (array.end == tag.end && tags_.next(end))
        if (end.name == "/DataArray")
          array.end = end.begin;
        else if (end.name == "InformationKey" || end.name == "/InformationKey" ||
                 end.name == "Value" || end.name == "/Value")
          continue;
        else
          break;
      if (end.name != "/DataArray")
        fail_vtu(file_, fmt::format("the array '{}' is cut short", array.name));
    }
    if (section_ == "Points") head_.points.push_back(array);
    if (section_ == "Cells") head_.cells[array.name] = array;
    if (section_ == "PointData") head_.point_data.push_back(array);
    if (section_ == "CellData") head_.cell_data.push_back(array);
  }

  const SideFile& file_;
  Tags tags_;
  VtuHead head_;
  std::string section_;
  bool ended_ = false;
};

}  // namespace

VtuHead read_vtu_head(const SideFile& file) {
  return HeadReader(file).read();
}

}  // namespace lahar
