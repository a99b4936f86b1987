// Keeps the waiting jobs and interrupts the running one.
#include "worker.h"

namespace marrow::viewer {

Worker::Worker() : thread_([this] { run(); }) {}

Worker::~Worker() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
        interrupt_ = true;
    }
    wake_.notify_one();
    thread_.join();
}

void Worker::post(Key key, Job job) {
    {
        const std::lock_guard lock(mutex_);
        waiting_[key] = std::move(job);
        if (running_ && key.urgency < running_->urgency) interrupt_ = true;
    }
    wake_.notify_one();
}

void Worker::forget(Key key) {
    const std::lock_guard lock(mutex_);
    waiting_.erase(key);
    if (running_ == key) {
        restart_ = false;
        interrupt_ = true;
    }
}

void Worker::forget_all() {
    const std::lock_guard lock(mutex_);
    waiting_.clear();
    restart_ = false;
    interrupt_ = true;
}

void Worker::run() {
    const Progress job_progress = [this](double) { return !interrupt_.load(std::memory_order_relaxed); };
    std::unique_lock lock(mutex_);
    while (true) {
        running_.reset();
        wake_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
        if (stop_) return;
        auto job = waiting_.extract(waiting_.begin());
        running_ = job.key();
        restart_ = true;
        interrupt_ = false;
        lock.unlock();
        bool done = true;
        try {
            job.mapped()(job_progress);
        } catch (const Cancelled&) {
            done = false;
        }
        if (done) job = {};  // frees what the job holds, outside the lock
        lock.lock();
        if (!done && restart_) waiting_.insert(std::move(job));  // does nothing if there is a newer one
    }
}

}  // namespace marrow::viewer
