/// \file JSON merge patches (RFC 7396).
#pragma once

#include "io/json/json_source.h"

namespace lahar {

/// Change `target` as `patch` says: members of objects are merged, null removes a member, all other
/// values replace what was there. Values keep the position of the text that they come from.
void merge_patch(JsonValue& target, const JsonValue& patch);

}  // namespace lahar
