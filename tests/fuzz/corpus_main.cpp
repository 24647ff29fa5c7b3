// Runs a fuzz target without libFuzzer: every file of a folder, then so many mutations of each, the same on every run.
// Arguments: FOLDER MUTATIONS. The input at hand is named when the target aborts.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <unistd.h>
#include <vector>

#include "tests/fuzz/fuzz.hpp"

namespace {

char at_hand[512];

void tell(int signal) {
    [[maybe_unused]] const ssize_t n = ::write(2, at_hand, std::strlen(at_hand));
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

class Lcg {
public:
    explicit Lcg(std::uint64_t seed) : state_{seed} {}
    std::size_t below(std::size_t n) {
        state_ = state_ * 6364136223846793005u + 1442695040888963407u;
        return n == 0 ? 0 : static_cast<std::size_t>((state_ >> 33) % n);
    }

private:
    std::uint64_t state_;
};

std::vector<std::uint8_t> mutate(std::vector<std::uint8_t> bytes, Lcg& random) {
    for (std::size_t n = 1 + random.below(6); n > 0; --n) {
        const std::size_t at = random.below(bytes.size() + 1);
        switch (random.below(5)) {
            case 0:
                if (at < bytes.size()) bytes[at] = static_cast<std::uint8_t>(random.below(256));
                break;
            case 1:
                if (at < bytes.size()) bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ (1u << random.below(8)));
                break;
            case 2: bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), static_cast<std::uint8_t>(random.below(256))); break;
            case 3:
                if (at < bytes.size()) bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(at));
                break;
            default: {
                constexpr std::uint8_t kEdges[] = {0, 1, 0x7F, 0x80, 0xFF};
                for (std::size_t i = at; i < at + 4 && i < bytes.size(); ++i) bytes[i] = kEdges[random.below(5)];
            }
        }
    }
    return bytes;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3) {
        std::fprintf(stderr, "usage: %s FOLDER MUTATIONS\n", argv[0]);
        return 2;
    }
    for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS}) std::signal(signal, tell);
    const long mutations = std::strtol(argv[2], nullptr, 10);
    long runs = 0;
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(argv[1])) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (const auto& file : files) {
        std::ifstream in(file, std::ios::binary);
        const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
        Lcg random(bytes.size() + 7);
        for (long i = 0; i <= mutations; ++i, ++runs) {
            std::snprintf(at_hand, sizeof at_hand, "corpus: %s, mutation %ld\n", file.c_str(), i);
            const auto input = i == 0 ? bytes : mutate(bytes, random);
            LLVMFuzzerTestOneInput(input.data(), input.size());
        }
    }
    std::printf("%ld inputs from %zu files\n", runs, files.size());
    return files.empty() ? 1 : 0;
}
