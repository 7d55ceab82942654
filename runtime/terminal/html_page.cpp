#include "runtime/terminal/html_page.h"

namespace lahar {

std::string within_script(std::string_view json) {
  std::string text;
  text.reserve(json.size());
  for (const char c : json) {
    if (c == '<')
      text += "\\u003c";
    else
      text += c;
  }
  return text;
}

std::string fill_page(std::string_view page,
                      const std::function<std::string(std::string_view name)>& part) {
  std::string text;
  for (;;) {
    const std::size_t mark = page.find("{{");
    text += page.substr(0, mark);
    if (mark == std::string_view::npos) return text;
    const std::size_t end = page.find("}}", mark);
    text += part(page.substr(mark + 2, end - mark - 2));
    page.remove_prefix(end + 2);
  }
}

}  // namespace lahar
