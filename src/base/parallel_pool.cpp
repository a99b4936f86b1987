// The pool of threads behind parallel_pool.h.
#include "parallel_pool.h"

#include "pool_limit.h"

#include <algorithm>
#include <exception>
#include <limits>

#ifdef MARROW_POOL_THREADS
#include <condition_variable>
#include <thread>
#include <vector>
#endif

namespace marrow::internal {

#ifdef MARROW_POOL_THREADS

namespace {

int most_threads = std::numeric_limits<int>::max();
thread_local int this_thread = 0;
thread_local bool within_loop = false;

// Threads wait for a job, and run it. One job runs at a time.
class Pool {
  public:
    Pool() {
        const int count = std::min(most_threads, static_cast<int>(std::thread::hardware_concurrency()));
        for (int i = 1; i < count; ++i) threads_.emplace_back([this, i] { serve(i); });
    }
    ~Pool() {
        {
            const std::lock_guard lock(mutex_);
            ended_ = true;
        }
        wake_.notify_all();
        for (std::thread& thread : threads_) thread.join();
    }

    int size() const { return static_cast<int>(threads_.size()) + 1; }

    void run(int threads, const std::function<void()>& f) {
        const std::lock_guard one_job(jobs_);
        {
            const std::lock_guard lock(mutex_);
            job_ = &f;
            wanted_ = std::min(threads, size()) - 1;
            thrown_ = nullptr;
        }
        wake_.notify_all();
        take_part(f);
        std::unique_lock lock(mutex_);
        wanted_ = 0;  // who did not start by now is not needed
        done_.wait(lock, [&] { return running_ == 0; });
        job_ = nullptr;
        if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
    }

  private:
    void serve(int number) {
        this_thread = number;
        std::unique_lock lock(mutex_);
        while (true) {
            wake_.wait(lock, [&] { return ended_ || wanted_ > 0; });
            if (ended_) return;
            --wanted_;
            ++running_;
            const std::function<void()>& job = *job_;
            lock.unlock();
            take_part(job);
            lock.lock();
            if (--running_ == 0) done_.notify_one();
        }
    }

    void take_part(const std::function<void()>& job) {
        within_loop = true;
        try {
            job();
        } catch (...) {
            const std::lock_guard lock(mutex_);
            if (!thrown_) thrown_ = std::current_exception();
        }
        within_loop = false;
    }

    std::mutex jobs_, mutex_;
    std::condition_variable wake_, done_;
    std::vector<std::thread> threads_;
    const std::function<void()>* job_ = nullptr;
    int wanted_ = 0, running_ = 0;  // threads that shall start, and that work
    bool ended_ = false;
    std::exception_ptr thrown_;
};

Pool& pool() {
    static Pool threads;
    return threads;
}

}  // namespace

void limit_pool(int threads) {
    most_threads = threads;
}

int pool_size() {
    return pool().size();
}

int pool_thread() {
    return this_thread;
}

void run_on_pool(int threads, const std::function<void()>& f) {
    if (threads <= 1 || within_loop)
        f();
    else
        pool().run(threads, f);
}

#else

void limit_pool(int) {}

int pool_size() {
    return 1;
}

int pool_thread() {
    return 0;
}

void run_on_pool(int, const std::function<void()>& f) {
    f();
}

#endif

int& pool_limit() {
    static int limit = pool_size();
    return limit;
}

}  // namespace marrow::internal
