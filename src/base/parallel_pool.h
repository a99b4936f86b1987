/// Parallel work by a small pool of threads, where oneTBB does not exist; parallel.h describes the interface.
/// Without support for threads everything runs on the calling thread.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <type_traits>
#include <unordered_map>
#include <utility>

namespace marrow::internal {

/// The threads that the pool has, the caller included.
int pool_size();

/// The number of the current thread: from 1 for those of the pool, 0 for all others.
int pool_thread();

/// Calls f on up to `threads` threads at the same time, one of which is the current one. Loops within loops
/// stay on their thread. \throw what f throws first
void run_on_pool(int threads, const std::function<void()>& f);

/// The threads that loops may use, until the next with_threads().
int& pool_limit();

template <class F>
void with_threads(int threads, const F& f) {
    struct Limit {
        explicit Limit(int limit) : before(std::exchange(pool_limit(), limit)) {}
        ~Limit() { pool_limit() = before; }
        int before;
    };
    const Limit limit(threads > 0 ? std::min(threads, pool_size()) : pool_size());
    f();
}

inline int thread_count() {
    return pool_limit();
}

/// A range of numbers, named as oneTBB's.
template <class Index>
struct PoolRange {
    Index first, last;
    Index begin() const { return first; }
    Index end() const { return last; }
};

// Threads take blocks one after the other, which evens out blocks of different work.
template <class Index, class F>
void parallel_for_ranges(Index begin, Index end, std::size_t grain, const F& f) {
    if (!(begin < end)) return;
    const auto count = static_cast<std::size_t>(end - begin);
    const std::size_t blocks =
        std::min<std::size_t>((count + grain - 1) / grain, 16 * static_cast<std::size_t>(thread_count()));
    const auto start_of = [&](std::size_t block) {
        // Divided first, because the product may not fit in 32 bits.
        return begin + static_cast<Index>(count / blocks * block + std::min(block, count % blocks));
    };
    std::atomic<std::size_t> next = 0;
    run_on_pool(static_cast<int>(std::min<std::size_t>(blocks, static_cast<std::size_t>(thread_count()))),
                [&] {
                    for (std::size_t block = next++; block < blocks; block = next++) {
                        try {
                            f(PoolRange<Index>{start_of(block), start_of(block + 1)});
                        } catch (...) {
                            next = blocks;  // the others start nothing new
                            throw;
                        }
                    }
                });
}

template <class Index, class F>
void parallel_for(Index begin, Index end, const F& f) {
    parallel_for_ranges(begin, end, 1, [&](const PoolRange<Index>& range) {
        for (Index i = range.begin(); i < range.end(); ++i) f(i);
    });
}

// In halves, as oneTBB divides a range, so that sums of floating-point numbers are the same.
template <class Index, class T, class F, class Join>
T parallel_reduce(Index begin, Index end, std::size_t grain, const T& identity, const F& f,
                  const Join& join) {
    if (static_cast<std::size_t>(end - begin) <= grain) return f(PoolRange<Index>{begin, end}, identity);
    const Index middle = begin + (end - begin) / 2u;
    const T lower = parallel_reduce(begin, middle, grain, identity, f, join);
    return join(lower, parallel_reduce(middle, end, grain, identity, f, join));
}

template <class... F>
void parallel_invoke(const F&... f) {
    const std::function<void()> functions[] = {std::function<void()>(std::cref(f))...};
    parallel_for(std::size_t{0}, sizeof...(f), [&](std::size_t i) { functions[i](); });
}

// The pool's threads take up no other work while they wait.
template <class F>
void isolate(const F& f) {
    f();
}

template <class T>
class PerThread {
    struct Element {
        T value;
    };
    using Elements = std::deque<Element>;  // keeps its elements in their places

  public:
    struct Iterator {
        typename Elements::iterator at;
        T& operator*() const { return at->value; }
        Iterator& operator++() {
            ++at;
            return *this;
        }
        friend bool operator!=(const Iterator& a, const Iterator& b) { return a.at != b.at; }
    };

    PerThread() : add_([](Elements& to) { to.emplace_back(); }) {}
    /// A copy of `value` for each thread, or what it returns if it is a function.
    template <class Value>
    explicit PerThread(Value value)
        : add_([value](Elements& to) {
              if constexpr (std::is_invocable_v<const Value&>)
                  to.push_back({value()});
              else
                  to.push_back({T(value)});
          }) {}

    T& local() {
        const std::lock_guard lock(mutex_);
        const auto [found, added] = by_thread_.emplace(pool_thread(), elements_.size());
        if (added) add_(elements_);
        return elements_[found->second].value;
    }
    Iterator begin() { return {elements_.begin()}; }
    Iterator end() { return {elements_.end()}; }

  private:
    std::function<void(Elements&)> add_;
    std::mutex mutex_;
    std::unordered_map<int, std::size_t> by_thread_;
    Elements elements_;
};

template <class Key, class Value, class Hash>
class ConcurrentMap {
  public:
    auto find(const Key& key) {
        const std::lock_guard lock(mutex_);
        return map_.find(key);
    }
    template <class... Args>
    auto emplace(Args&&... args) {
        const std::lock_guard lock(mutex_);
        return map_.emplace(std::forward<Args>(args)...);
    }
    auto end() {
        const std::lock_guard lock(mutex_);
        return map_.end();
    }

  private:
    std::mutex mutex_;
    std::unordered_map<Key, Value, Hash> map_;
};

}  // namespace marrow::internal
