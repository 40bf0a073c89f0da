// A library that is looked for at run time: without the device, neither the library nor its headers are needed.
#pragma once

#include <dlfcn.h>

#include <string>

#include "common/core/error.h"

namespace sectio {

class Library {
 public:
  // Throws InputError when it can't be loaded.
  Library(std::string device, const std::string& file)
      : device_(std::move(device)), file_(file), library_(dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL)) {
    if (library_) return;
    const char* why = dlerror();
    throw InputError("--device " + device_ + ": its maker's library isn't here: " + (why ? why : file));
  }
  ~Library() { dlclose(library_); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  template <class Function>
  void find(const char* name, Function*& function) const {
    function = reinterpret_cast<Function*>(dlsym(library_, name));
    if (!function) throw InputError("--device " + device_ + ": " + file_ + " has no function " + name);
  }

  static bool is_here(const char* file) {
    void* library = dlopen(file, RTLD_LAZY | RTLD_LOCAL);
    if (library) dlclose(library);
    return library != nullptr;
  }

 private:
  std::string device_, file_;
  void* library_;
};

}  // namespace sectio
