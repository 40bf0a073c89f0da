// The local contact model of a tool on its way to the hand (idl/tool.idl).
#pragma once

#include <cstdint>

#include "common/math/contact_model.h"

namespace sectio {

struct ContactMessage {
  std::uint64_t epoch = 0;
  ContactModel model;
};

}  // namespace sectio
