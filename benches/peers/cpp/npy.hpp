// What the C++ peers share: reading the arrays V (u4) and G (f4), the clock, and the lines of JSON that
// the runner reads. A line is printed as soon as a phase is over, so that a peer that is ended by a
// time-out has said what it did.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

namespace peer {

[[noreturn]] inline void fail(const std::string& what) {
  std::fprintf(stderr, "%s\n", what.c_str());
  std::exit(1);
}

// The rows of three of an .npy file of version 1.0 whose type is `descr`.
template <class T>
std::vector<T> load(const char* path, const char* descr) {
  std::ifstream in(path, std::ios::binary);
  char head[10];
  if (!in.read(head, 10) || std::memcmp(head, "\x93NUMPY\x01", 7) != 0) fail(std::string(path) + ": no npy file");
  const std::size_t length = static_cast<unsigned char>(head[8]) | static_cast<unsigned char>(head[9]) << 8;
  std::string text(length, ' ');
  in.read(&text[0], static_cast<std::streamsize>(length));
  if (text.find(descr) == std::string::npos) fail(std::string(path) + ": its type is not " + descr);
  const std::size_t shape = text.find('(');
  const std::size_t rows = std::strtoull(text.c_str() + shape + 1, nullptr, 10);
  std::vector<T> values(3 * rows);
  if (!in.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T))))
    fail(std::string(path) + ": too short");
  return values;
}

// V, less the triangles with a repeated vertex: no peer takes them well, and a careful user would leave
// them out.
inline std::vector<std::uint32_t> load_triangles(const char* path) {
  auto v = load<std::uint32_t>(path, "<u4");
  std::size_t kept = 0;
  for (std::size_t i = 0; i < v.size(); i += 3) {
    const std::uint32_t a = v[i], b = v[i + 1], c = v[i + 2];
    if (a == b || b == c || c == a) continue;
    v[kept] = a, v[kept + 1] = b, v[kept + 2] = c;
    kept += 3;
  }
  v.resize(kept);
  return v;
}

// Writes the oriented triangles for the judge, in the order of the input.
inline void save(const char* path, const std::vector<std::uint32_t>& v) {
  std::string text = "{'descr': '<u4', 'fortran_order': False, 'shape': (" + std::to_string(v.size() / 3) + ", 3), }";
  text.resize(117, ' ');
  text += '\n';
  std::ofstream out(path, std::ios::binary);
  out.write("\x93NUMPY\x01\x00\x76\x00", 10);
  out << text;
  out.write(reinterpret_cast<const char*>(v.data()), static_cast<std::streamsize>(v.size() * 4));
  if (!out.flush()) fail(std::string(path) + ": cannot be written");
}

// Times phases and prints them.
class Phases {
 public:
  Phases() : last_(std::chrono::steady_clock::now()) {}

  void done(const char* name) {
    const auto now = std::chrono::steady_clock::now();
    std::printf("{\"phase\": \"%s\", \"seconds\": %.6f}\n", name, std::chrono::duration<double>(now - last_).count());
    std::fflush(stdout);
    last_ = std::chrono::steady_clock::now();
  }

  void answer(const char* name, std::uint64_t value) {
    std::printf("{\"answer\": \"%s\", \"value\": %llu}\n", name, static_cast<unsigned long long>(value));
    std::fflush(stdout);
  }

  void note(const std::string& text) {
    std::printf("{\"note\": \"%s\"}\n", text.c_str());
    std::fflush(stdout);
  }

  // The peak of this process by the kernel, at the end of the work.
  void end() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
      if (line.rfind("VmHWM:", 0) == 0) std::printf("{\"hwm_kib\": %ld}\n", std::atol(line.c_str() + 6));
    std::printf("{\"finished\": true}\n");
    std::fflush(stdout);
  }

 private:
  std::chrono::steady_clock::time_point last_;
};

}  // namespace peer
