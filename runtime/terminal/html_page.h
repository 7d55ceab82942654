/// \file Pages that are one file: a template whose marks {{name}} are filled.
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace lahar {

/// JSON within a <script>: nothing in it may look like HTML.
std::string within_script(std::string_view json);

/// `part` gives what stands for a mark.
std::string fill_page(std::string_view page,
                      const std::function<std::string(std::string_view name)>& part);

}  // namespace lahar
