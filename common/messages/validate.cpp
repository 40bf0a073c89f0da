#include "common/messages/validate.h"

namespace sectio {

std::string Validator::at_index(std::size_t index, const std::string& flaw) {
  std::string text = "[";
  text += std::to_string(index);
  text += "]";
  text += flaw;
  return text;
}

}  // namespace sectio
