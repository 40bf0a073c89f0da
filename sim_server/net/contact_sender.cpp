#include "sim_server/net/contact_sender.h"

#include <algorithm>
#include <utility>

namespace sectio {

ContactSender::ContactSender(std::function<void(const ContactModel&)> send)
    : send_(std::move(send)), thread_([this] { run(); }) {}

ContactSender::~ContactSender() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void ContactSender::put(std::span<const ContactModel> models) {
  if (models.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    for (const ContactModel& model : models) {
      const auto same = std::ranges::find(waiting_, model.tool_id, &ContactModel::tool_id);
      if (same == waiting_.end())
        waiting_.push_back(model);
      else
        *same = model;
    }
  }
  wake_.notify_one();
}

void ContactSender::run() {
  std::vector<ContactModel> batch;
  std::unique_lock lock(mutex_);
  while (!stop_ || !waiting_.empty()) {
    wake_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
    std::swap(batch, waiting_);
    lock.unlock();
    for (const ContactModel& model : batch) send_(model);
    batch.clear();
    lock.lock();
  }
}

}  // namespace sectio
