// Runs records through a core; `replay_bench.py` does the same under cocotb.
//
// Arguments: word width, lanes. Batches come on standard input, results go to standard output, all
// in the byte order of this computer. Between batches the core stands still, so a closed loop is a
// batch of one record at a time.
//
// Batch: int64 records, writes, stall, trace, limit (`Batch`); then int32: the number of words of
// each record; all words; for each bus write its record, address and word; for a reset its record,
// -1 and the cycles from the first word taken to it; for a restart -2 in place of -1. If the update is
// complete before, they come then.
// Results: four arrays of int32, each behind its size (int64). For each record the number of output
// words, its flags (1: saturated, 2: input beyond its range), the cycles until the next record could begin (-2: a reset came before;
// -1, in the last one: not complete after `limit` cycles); all output words; the cycle of each; for
// each register write of the traced record lane, address, word, cycle.

#include "Vbench.h"
#include "verilated.h"
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <unistd.h>
#include <vector>

using Words = std::vector<int32_t>;

struct Batch {
    int64_t records, writes, stall, trace, limit;
};

static bool read(void *data, size_t size) { return std::fread(data, size, 1, stdin) == (size > 0); }

class Harness {
  public:
    Harness(Vbench &bench, int word, int lanes)
        : bench(bench), word(word), lanes(lanes), last(uint64_t(1) << word) {
        bench.rst = 1;
        bench.restart = 0;
        for (int k = 0; k < RESET_CYCLES; ++k) step();
        bench.rst = 0;
    }

    void run(const Batch &batch, const Words &counts, const Words &in, const Words &writes);

    Words updates, words, cycles, traced;

  private:
    // One cycle of the clock; then outputs are as they were before its edge.
    void step() {
        bench.step ^= 1;
        bench.eval();
    }

    void trace(int64_t cycle) {
        for (int k = 0; k < lanes; ++k)
            if (uint64_t(bench.w_en) >> k & 1)
                traced.insert(
                    traced.end(),
                    {k, int32_t(bench.w_addr >> 10 * k & 1023),
                     int32_t(uint64_t(bench.w_data) >> word * k & (last - 1)), int32_t(cycle)}
                );
    }

    Vbench &bench;
    const int word, lanes;
    const uint64_t last;
    int64_t update = 0;
};

void Harness::run(
    const Batch &batch, const Words &counts, const Words &in, const Words &writes
) {
    for (Words *const part : {&updates, &words, &cycles, &traced}) part->clear();
    const int32_t *input = in.data(), *write = writes.data();
    const int32_t *const end = write + writes.size();
    uint32_t lfsr = 0x2f6e2b1 + uint32_t(batch.stall);
    int64_t in_record = 0, cycle = 0, begin = 0;
    update = 0;
    int in_word = 0;
    bool offer = true, counting = false, complete = false;
    const auto finish = [&](int64_t interval) {
        const int32_t count(words.size() - begin);
        updates.insert(updates.end(), {count, bench.flags, int32_t(interval)});
        begin += count;
        complete = false;
        ++update;
    };
    const auto give = [&] {
        words.push_back(int32_t(uint32_t(bench.out_payload) << (32 - word)) >> (32 - word));
        cycles.push_back(int32_t(cycle));
        complete = (bench.out_payload & last) != 0;
    };
    for (int64_t left = batch.limit;; --left) {
        const bool resets = write != end && write[1] < 0;
        const bool now = resets
            && (update > *write || (counting && update == *write && cycle >= write[2]));
        bench.restart = now && write[1] == -2;
        if (now && write[1] == -1) {
            bench.in_valid = bench.bus_stb = 0;
            bench.out_ready = bench.rst = 1;
            step();
            bench.rst = 0;
            if (bench.out_valid) give();
            if (update == *write) {
                if (in_record == update) input += counts[in_record] - in_word;
                finish(-2);
                in_record = update;
            }
            in_word = 0;
            counting = false;
            offer = true;
            write += 3;
            if (update == batch.records) break;
            continue;
        }
        const bool waits =
            in_word == 0 && write != end && (resets ? *write < in_record : *write == in_record);
        const bool valid = offer && in_record < batch.records && !waits;
        const bool strobe = waits && !counting && !resets;
        const bool take = !batch.stall || ((lfsr >> 3 ^ lfsr >> 17) & 1);
        const bool ends = valid && in_word == counts[in_record] - 1;
        bench.in_valid = valid;
        if (valid) bench.in_payload = (uint32_t(*input) & (last - 1)) | (ends ? last : 0);
        bench.out_ready = take;
        bench.bus_stb = strobe;
        if (strobe) {
            bench.bus_addr = write[1];
            bench.bus_data = write[2] & (last - 1);
        }
        step();
        if (counting && update == batch.trace) trace(cycle);
        // The core asks for the first word of the next record: the last update is complete.
        const bool asks = bench.in_ready && in_word == 0 && counting && complete
            && in_record == update + 1;
        if (asks) finish(cycle);
        if (update == batch.records) break;
        if (left <= 0) {
            finish(-1);
            break;
        }
        const bool taken = valid && bench.in_ready, given = bench.out_valid && take;
        if (given) give();
        if (bench.restart || (strobe && bench.bus_ack)) write += 3;
        ++cycle;
        if (asks) counting = false;
        if (taken) {
            if (in_word == 0) {
                cycle = 1;
                counting = true;
            }
            in_word = ends ? 0 : in_word + 1;
            in_record += ends;
            ++input;
            offer = !batch.stall || (lfsr >> 5 & 1);
        } else if (!offer) {
            offer = lfsr >> 9 & 1;
        }
        lfsr = lfsr << 1 | ((lfsr >> 31 ^ lfsr >> 21 ^ lfsr >> 1 ^ lfsr) & 1);
    }
}

int main(int argc, char **argv) {
    if (argc < 3) return 2;
    // What the core prints must not come between the results.
    FILE *const output = fdopen(dup(1), "wb");
    dup2(2, 1);
    VerilatedContext context;
    context.randReset(2);
    context.randSeed(7);
    Vbench bench{&context};
    Harness harness{bench, std::atoi(argv[1]), std::atoi(argv[2])};
    Batch batch;
    while (read(&batch, sizeof batch)) {
        Words counts(batch.records);
        if (!read(counts.data(), 4 * counts.size())) return 3;
        Words in(std::accumulate(counts.begin(), counts.end(), int64_t(0))), writes(3 * batch.writes);
        if (!read(in.data(), 4 * in.size()) || !read(writes.data(), 4 * writes.size())) return 3;
        harness.run(batch, counts, in, writes);
        for (const Words *part :
             {&harness.updates, &harness.words, &harness.cycles, &harness.traced}) {
            const int64_t size = part->size();
            std::fwrite(&size, sizeof size, 1, output);
            std::fwrite(part->data(), 4, part->size(), output);
        }
        std::fflush(output);
    }
    bench.final();
    return 0;
}
