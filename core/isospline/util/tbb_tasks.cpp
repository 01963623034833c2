#include "isospline/util/tbb_tasks.h"

#include "isospline/util/fork.h"
#include "isospline/util/thread_pool.h"

#include <tbb/info.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <exception>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace isospline {

namespace {

/// An arena that reserves all places for threads that enter it by themselves, so that TBB starts none.
struct Arena {
    const int places = tbb::info::default_concurrency();
    tbb::task_arena arena{places, static_cast<unsigned>(places)};
};

/// Arenas are reused, because TBB keeps memory for every arena that was ever made.
class IdleArenas {
public:
    static IdleArenas& instance()
    {
        static auto& idle = *new IdleArenas; // never destroyed: threads may use it until the process ends
        return idle;
    }

    std::unique_ptr<Arena> take()
    {
        {
            const std::lock_guard lock(fork_safe_mutex(this));
            if (!arenas_.empty()) {
                auto arena = std::move(arenas_.back());
                arenas_.pop_back();
                return arena;
            }
        }
        return std::make_unique<Arena>();
    }

    void give_back(std::unique_ptr<Arena> arena)
    {
        const std::lock_guard lock(fork_safe_mutex(this));
        arenas_.push_back(std::move(arena));
    }

private:
    std::vector<std::unique_ptr<Arena>> arenas_;
};

} // namespace

void run_tbb_tasks(const std::function<void()>& work,
                   const std::function<void(const std::function<void()>&)>& as_helper)
{
    const InsideTbb inside_tbb;
    auto arena = IdleArenas::instance().take();
    tbb::task_group group;
    // Helpers wait for this task, which never runs. Meanwhile they run the other tasks of the arena.
    tbb::task_handle end = group.defer([] {});
    const std::function<void()> help = [&] { arena->arena.execute([&] { group.wait(); }); };
    std::exception_ptr raised;
    run_with_help(
        arena->places - 1,
        [&] {
            try {
                arena->arena.execute(work);
            } catch (...) {
                raised = std::current_exception();
            }
            end = {};
        },
        [&] {
            try {
                as_helper ? as_helper(help) : help();
            } catch (...) { // this thread cannot help
            }
        });
    IdleArenas::instance().give_back(std::move(arena));
    if (raised)
        std::rethrow_exception(raised);
}

} // namespace isospline
