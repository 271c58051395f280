// What a control loop must not meet: memory, locks and exceptions while a pedestrian is predicted. The C library's own
// entries are counted, so that nothing underneath escapes.

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <cstdlib>

#include "predict/flow_field_index.hpp"
#include "sila/config.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"
#include "support/sanitized.hpp"

// Sanitizers have an allocator of their own, which must not be replaced.
#if !SILA_SANITIZED

namespace {

thread_local bool counting = false;
thread_local long allocations = 0, locks = 0;  // an exception allocates, too

using Lock = int (*)(pthread_mutex_t*);
const Lock real_lock = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));

}  // namespace

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  allocations += counting ? 1 : 0;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  allocations += counting ? 1 : 0;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  allocations += counting ? 1 : 0;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  allocations += counting ? 1 : 0;
  return __libc_memalign(alignment, size);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) {
  locks += counting ? 1 : 0;
  // Before this file's globals exist nobody counts and one thread runs.
  return real_lock ? real_lock(mutex) : 0;
}
}

namespace sila {
namespace {

struct Counts {
  long allocations = 0, locks = 0;
};

template <class Work>
Counts counts_of(const Work& work) {
  allocations = locks = 0;
  counting = true;
  work();
  counting = false;
  return {allocations, locks};
}

void expect_quiet(const EpisodeConfig& config) {
  const Model model = testing::learnt(testing::corner_walks(80, 21), config);
  const std::vector<Window> windows = windows_of(testing::corner_walks(20, 99), config.sampling, config.predict, 0.4);
  ASSERT_GT(windows.size(), 50u);
  const Predictor predictor(model, config.predict);
  Workspace workspace;
  for (const Window& window : windows) predictor.predict(window.observed, workspace);
  for (const Window& window : windows) {
    const Prediction fresh = predictor.predict(window.observed);
    const Counts counts = counts_of([&] { predictor.predict(window.observed, workspace); });
    EXPECT_EQ(counts.allocations, 0);
    EXPECT_EQ(counts.locks, 0);
    // What was left from other people does not show.
    EXPECT_EQ(workspace.prediction.modes, fresh.modes);
  }
}

TEST(Workspace, CountsWhatItPromisesNotToDo) {
  const Counts counts = counts_of([] {
    std::vector<int> numbers(3);
    pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
    pthread_mutex_lock(&mutex);
    pthread_mutex_unlock(&mutex);
    EXPECT_EQ(numbers.size(), 3u);
  });
  EXPECT_GE(counts.allocations, 1);
  EXPECT_EQ(counts.locks, 1);
}

TEST(Workspace, OnceItIsLargeEnoughAPredictionNeitherAllocatesNorLocks) {
  expect_quiet({});
}

TEST(Workspace, TheSameInThePapersProfile) {
  expect_quiet(with_profile({}, "paper").episode);
  expect_quiet(with_profile({}, "paper-literal").episode);
}

TEST(FlowFieldIndex, OfFieldsThatReachFarOnAFineGridMakesNoBuckets) {
  const EpisodeConfig config;
  Model model = testing::learnt(testing::corner_walks(20, 21), config);
  const double scale = model.transitions.front().field.gp.kernel.length_scales.maxCoeff();
  model.settings.grid.cell = scale / 45.0;  // nearly 10,000 cells are within one length scale
  const Counts counts = counts_of([&] { Predictor(model, config.predict); });
  EXPECT_LT(counts.allocations, 10000);  // with the buckets 400,000
}

}  // namespace
}  // namespace sila

#endif
