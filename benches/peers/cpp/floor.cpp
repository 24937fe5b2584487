// What the machine can do: memory copied by one thread and by two, and a file written, synced and read.
// usage: floor FILE [MIB]; the file is removed. Reading is tried past the page cache, which is emptied of
// the file first (posix_fadvise); the system may decline.
#include "npy.hpp"

#include <algorithm>
#include <fcntl.h>
#include <thread>
#include <unistd.h>

static double copy(int threads, std::size_t bytes) {
  std::vector<std::vector<char>> from(threads, std::vector<char>(bytes, 1)), to(threads, std::vector<char>(bytes, 2));
  double best = 0;
  for (int round = 0; round < 5; ++round) {
    const auto start = std::chrono::steady_clock::now();
    std::vector<std::thread> all;
    for (int i = 0; i < threads; ++i) all.emplace_back([&, i] { std::memcpy(to[i].data(), from[i].data(), bytes); });
    for (auto& t : all) t.join();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    best = std::max(best, threads * bytes / seconds);
  }
  return best;
}

int main(int argc, char** argv) {
  if (argc < 2) peer::fail("usage: floor FILE [MIB]");
  const std::size_t mib = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1024, block = 1 << 20;
  std::vector<char> buffer(block);
  for (std::size_t i = 0; i < block; ++i) buffer[i] = static_cast<char>(i * 2654435761u >> 13);
  const int file = open(argv[1], O_RDWR | O_CREAT | O_TRUNC, 0600);
  if (file < 0) peer::fail(std::string(argv[1]) + ": cannot be made");
  const auto seconds = [](auto start) { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  auto start = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < mib; ++i)
    if (write(file, buffer.data(), block) != static_cast<ssize_t>(block)) peer::fail("short write");
  if (fsync(file) != 0) peer::fail("no sync");
  const double written = seconds(start);
  posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
  lseek(file, 0, SEEK_SET);
  start = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < mib; ++i)
    if (read(file, buffer.data(), block) != static_cast<ssize_t>(block)) peer::fail("short read");
  const double read_seconds = seconds(start);
  close(file);
  unlink(argv[1]);
  const double bytes = double(mib) * block, mb = 1e6;
  std::printf("{\"copy_one_thread_mb_s\": %.0f, \"copy_two_threads_mb_s\": %.0f, \"file_mib\": %zu, \"write_and_sync_mb_s\": %.0f, \"read_mb_s\": %.0f}\n",
              copy(1, 256 << 20) / mb, copy(2, 256 << 20) / mb, mib, bytes / written / mb, bytes / read_seconds / mb);
}
