#include "common/math/archive.h"

#include <mutex>

namespace sectio::archived {

std::string_view constant(const std::string& text) {
  static std::mutex mutex;
  static std::set<std::string> texts;
  const std::lock_guard lock(mutex);
  return *texts.insert(text).first;
}

}  // namespace sectio::archived
