// Sends contact models to hands, on a thread of its own: no state and no keyframe goes before them.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "common/math/contact_model.h"

namespace sectio {

class ContactSender {
 public:
  // `send` is called by the thread.
  explicit ContactSender(std::function<void(const ContactModel&)> send);
  ~ContactSender();  // sends what is left

  // The newest model of each tool replaces one that still waits. Any thread; never waits for the wire.
  void put(std::span<const ContactModel> models);

 private:
  void run();

  std::function<void(const ContactModel&)> send_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<ContactModel> waiting_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace sectio
