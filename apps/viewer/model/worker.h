/// A thread that runs jobs by urgency.
#pragma once

#include <atomic>
#include <compare>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include <marrow/error.h>
#include <marrow/progress.h>

namespace marrow::viewer {

/// Runs one job at a time, the most urgent first.
///
/// A new job replaces a waiting job with the same key. A running job with this key continues, so that results
/// appear even if requests arrive faster than they are done; forget() stops it. Only a more urgent job
/// interrupts the running one, which restarts later unless a newer job has taken its key.
///
/// A job reports to the Progress that it receives, which throws Cancelled to interrupt it. It must catch all
/// other errors itself.
class Worker {
  public:
    struct Key {
        int urgency;  ///< smaller runs earlier
        int subject;
        auto operator<=>(const Key&) const = default;
    };
    using Job = std::function<void(const Progress& job_progress)>;

    Worker();
    /// Interrupts the running job and waits for its end.
    ~Worker();

    void post(Key key, Job job);
    /// Drops the job with this key, even if it is running.
    void forget(Key key);
    void forget_all();

  private:
    void run();

    std::mutex mutex_;
    std::condition_variable wake_;
    std::map<Key, Job> waiting_;
    std::optional<Key> running_;
    bool restart_ = false;  // the running job waits again if it is interrupted
    bool stop_ = false;
    std::atomic<bool> interrupt_{false};
    std::thread thread_;  // last, because it uses the other members
};

}  // namespace marrow::viewer
