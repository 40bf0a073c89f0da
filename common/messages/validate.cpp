#include "common/messages/validate.h"

#include "common/core/formatted.h"

namespace sectio {

std::string Validator::flaw_of(double number, Limits own) {
  if (own.contain(number)) return "";
  const std::string range = own.most < Limits().most     ? formatted("%.6g to %.6g", own.least, own.most)
                            : own.least > Limits().least ? formatted(">= %.6g", own.least)
                                                         : "a finite number";
  return formatted(": expected %s, got %.6g", range.c_str(), number);
}

std::string Validator::at_index(std::size_t index, const std::string& flaw) {
  std::string text = "[";
  text += std::to_string(index);
  text += "]";
  text += flaw;
  return text;
}

}  // namespace sectio
