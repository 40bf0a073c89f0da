#include "common/messages/validate.h"

#include <cstdio>

namespace sectio {

std::string Validator::flaw_of(double number, Limits own) {
  if (own.contain(number)) return "";
  char range[64] = "a finite number", text[112];
  if (own.most < Limits().most)
    std::snprintf(range, sizeof range, "%.6g to %.6g", own.least, own.most);
  else if (own.least > Limits().least)
    std::snprintf(range, sizeof range, ">= %.6g", own.least);
  std::snprintf(text, sizeof text, ": expected %s, got %.6g", range, number);
  return text;
}

std::string Validator::at_index(std::size_t index, const std::string& flaw) {
  std::string text = "[";
  text += std::to_string(index);
  text += "]";
  text += flaw;
  return text;
}

}  // namespace sectio
