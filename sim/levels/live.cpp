// Runs the core one record at a time: words in on standard input, words out on standard output.
//
// Arguments: inputs of a record, word width, address of the program register (or -1), program, most
// cycles of an update. Each record is that many 32-bit words in; its answer is the number of
// outputs, the outputs, the saturation flag, the cycles until the next record may begin. An update
// that does not end answers with -1 outputs.

#include "Vbench.h"
#include "verilated.h"
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

static VerilatedContext context;
static Vbench *bench;

static void clock_edge() {
    bench->clk = 1;
    bench->eval();
    bench->clk = 0;
    bench->eval();
}

static void select(int address, int program) {
    bench->bus_addr = address;
    bench->bus_data = program;
    bench->bus_stb = 1;
    bench->eval();
    for (int k = 0; k < 64; ++k) {
        const bool done = bench->bus_ack;
        clock_edge();
        if (done) break;
    }
    bench->bus_stb = 0;
    bench->eval();
}

int main(int argc, char **argv) {
    if (argc < 6) return 2;
    const int inputs = std::atoi(argv[1]), word = std::atoi(argv[2]);
    const int address = std::atoi(argv[3]), program = std::atoi(argv[4]);
    const long most = std::atol(argv[5]);
    const uint64_t mask = (uint64_t(1) << word) - 1, last = uint64_t(1) << word;
    context.randReset(2);
    context.randSeed(7);
    bench = new Vbench{&context};
    bench->in_valid = 0;
    bench->bus_stb = 0;
    bench->rst = 1;
    bench->eval();
    for (int k = 0; k < 4; ++k) clock_edge();
    bench->rst = 0;
    bench->eval();
    if (address >= 0) select(address, program);
    std::vector<int32_t> in(inputs), out;
    while (std::fread(in.data(), 4, inputs, stdin) == size_t(inputs)) {
        out.assign(1, 0);
        int next = 0;
        bool ended = false, saturated = false;
        long cycles = 0;
        for (long idle = 0; idle < most && !ended; ++idle) {
            bench->in_valid = next < inputs;
            if (next < inputs)
                bench->in_payload = (uint64_t(uint32_t(in[next])) & mask)
                    | (next == inputs - 1 ? last : 0);
            bench->eval();
            // All is answered and the core asks for the next record.
            if (next == inputs && out[0] < 0 && bench->in_ready) {
                ended = true;
                saturated = bench->saturated;
                break;
            }
            const bool taken = bench->in_valid && bench->in_ready, given = bench->out_valid;
            const uint64_t payload = bench->out_payload;
            clock_edge();
            if (next > 0 || taken) ++cycles;
            if (taken) ++next;
            if (given) {
                out.push_back(int32_t(uint32_t(payload & mask)));
                if (payload & last) out[0] = -1;  // the last word of the answer is here
            }
        }
        const int32_t count = ended ? int32_t(out.size()) - 1 : -1;
        out[0] = count;
        if (!ended) out.resize(1);
        out.push_back(saturated);
        out.push_back(int32_t(cycles));
        std::fwrite(out.data(), 4, out.size(), stdout);
        std::fflush(stdout);
    }
    bench->final();
    delete bench;
    return 0;
}
