// A thread that does jobs, the most urgent first.
#pragma once

#include <atomic>
#include <compare>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include <marrow/progress.h>

namespace marrow::viewer {

/// Calls `progress` if there is one. \throw Cancelled if it returns false
inline void report(const Progress& progress, double fraction) {
    if (progress && !progress(fraction)) throw Cancelled();
}

/// Does one job at a time. A job that is posted under the key of one that waits replaces it: the newest request wins. One
/// that runs goes on, so that requests which come faster than they are done are not all in vain; forget() ends it. Only a
/// more urgent job interrupts it, and it is done again from its start later, unless there is a newer one then.
///
/// To be interrupted, a job reports its progress to what it is given, which throws it out with Cancelled. Jobs catch
/// their other errors themselves.
class Worker {
  public:
    struct Key {
        int urgency;  ///< smaller is sooner
        int subject;
        auto operator<=>(const Key&) const = default;
    };
    using Job = std::function<void(const Progress& unless_interrupted)>;

    Worker();
    /// Interrupts what runs and waits for its end.
    ~Worker();

    void post(Key key, Job job);
    /// Drops the job of that key, also where it runs.
    void forget(Key key);
    void forget_all();

  private:
    void run();

    std::mutex mutex_;
    std::condition_variable wake_;
    std::map<Key, Job> waiting_;
    std::optional<Key> running_;
    bool again_ = false;  // what is interrupted comes back
    bool stop_ = false;
    std::atomic<bool> interrupt_{false};
    std::thread thread_;  // last: it uses the others
};

}  // namespace marrow::viewer
