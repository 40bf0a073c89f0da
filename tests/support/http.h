// One HTTP request to a program on this machine, and all of its answer.
#pragma once

#include <string>

namespace sectio::test {

struct HttpAnswer {
  int status = 0;  // 0: nobody answered
  std::string head, body;
};

HttpAnswer http_get(int port, const std::string& path);

}  // namespace sectio::test
