#include "render/threads/thread_pool.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace fovea::threads {
namespace {

TEST(ThreadPool, DoesEveryRowOnce) {
    for (const int threads : {1, 2, 5}) {
        ThreadPool pool(threads);
        for (int round = 0; round < 200; ++round) {
            std::vector<int> done(97, 0);
            pool.run(97, 1 + round % 13, [&](int begin, int end) {
                for (int i = begin; i < end; ++i) ++done[static_cast<std::size_t>(i)];
            });
            for (const int d : done) ASSERT_EQ(d, 1);
        }
    }
}

}  // namespace
}  // namespace fovea::threads
