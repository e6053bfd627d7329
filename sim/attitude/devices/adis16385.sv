// ADIS16385 at its pins: registers, pipelined frames, data-ready, reset, and the ways to go wrong.
//
// Register map, word formats and rate are the maker's; the meaning of DIAG_STAT, MSC_CTRL,
// SMPL_PRD, and of writes is a sibling part's; times of start-up and of the data-ready pulse are
// unverified, hence parameters. All of it is clocked by clk, with times in cycles, so that it runs
// in any simulator. Pins may change with clk only.
//
// +adis_log=FILE     samples, one line each: gx gy gz ax ay az temperature diag (decimal counts);
//                    the last one stays, log_done rises
// +adis_faults=FILE  lines: first last bit; from sample instant `first` to `last`, the fault is on
// Faults (bit, name):
//   0 wrong_identity   PROD_ID is another one's
//   1 absent           the lines are not driven: dout high, no data-ready
//   2 stuck_low        dout
//   3 stuck_high       dout
//   4 no_data_ready
//   5 fast_data_ready  FAST times as often, new data as before
//   6 alarm            DIAG_STAT bits 9 and 8
//   7 over_range       x gyro at +24000, DIAG_STAT bit 4
//   8 reset            by itself, once, in the middle of a frame
//   9 ignore_writes
//  10 bit_flips        one random bit of each answer
//  11 lost_settings    settings are at their defaults, and stay there
//  12 link_failure     DIAG_STAT bit 3
//
// +adis_self_test=BITS   bits of DIAG_STAT (hex) that a self-test, MSC_CTRL bit 10, sets at its end
//
// What the other side does wrong is printed and counted in `violations`.
`default_nettype none
module adis16385_device #(
    parameter longint CLOCK_HZ = 100_000_000,
    parameter longint RATE_HZ = 1024,         // of samples
    parameter longint PPM = 0,                // by which the device's own clock is fast
    parameter int STARTUP = 18_000_000,       // cycles from reset to life
    parameter int READY_PULSE = 5_000,        // cycles of the data-ready pulse
    parameter int STALL_MIN = 900,            // fewest cycles between frames
    parameter int HALF_MIN = 25,              // fewest cycles of half a period of sclk
    parameter int SETUP_MIN = 5,              // fewest cycles from cs_n to sclk
    parameter int RESET_MIN = 1_000,          // fewest cycles of a reset pulse
    parameter int SELF_TEST = 1_000,          // cycles of a self-test
    parameter int DOUT_DELAY = 10,            // cycles from the falling edge to the bit
    parameter int FAST = 8
) (
    input  wire        clk,
    input  wire        cs_n,
    input  wire        sclk,
    input  wire        din,
    output reg         dout,
    output reg         dio1,
    input  wire        rst_n,
    input  wire        hold_log,   // stay at the log's first line
    input  wire [15:0] fault,      // in addition to the faults of the file
    output reg         log_done,
    output reg  [31:0] line,       // of the log, from 1 on, that the data registers hold
    output reg  [31:0] instants,   // sample instants so far
    output reg  [31:0] frames,     // whole frames so far
    output reg  [31:0] violations
);
    // --- Faults -------------------------------------------------------------------------------
    localparam int ENTRIES = 256;
    integer first_of[ENTRIES], last_of[ENTRIES], bit_of[ENTRIES], entries, file, got, n, from, to;
    reg [8*256-1:0] path;
    reg [15:0] scheduled;
    reg [15:0] on;  // both kinds

    integer log_file, testing;
    reg [15:0] failing;
    initial begin
        testing = 0;
        if (!$value$plusargs("adis_self_test=%h", failing)) failing = 16'h0;
        entries = 0;
        if ($value$plusargs("adis_faults=%s", path)) begin
            file = $fopen(path, "r");
            got = 3;
            while (got == 3) begin
                got = $fscanf(file, "%d %d %d", from, to, n);
                first_of[entries] = from;
                last_of[entries] = to;
                bit_of[entries] = n;
                if (got == 3) entries = entries + 1;
            end
            $fclose(file);
        end
        log_file = 0;
        if ($value$plusargs("adis_log=%s", path)) log_file = $fopen(path, "r");
    end

    // --- Registers ----------------------------------------------------------------------------
    reg [15:0] memory[0:63];       // by address / 2
    reg [15:0] diag_held;          // bits that stay until they are read
    reg alive;                     // start-up is over
    integer waiting;               // cycles of start-up left
    localparam [5:0] TEMP = 6'h08, MSC = 6'h1A, SMPL = 6'h1B, SENS = 6'h1C, DIAG = 6'h1E,
                     GLOB = 6'h1F, PROD = 6'h2B;

    function automatic writable(input [5:0] word);
        writable = (word >= 6'h0D && word <= 6'h1D) || word == GLOB;
    endfunction

    // Bits that exist; writes to others are lost.
    function automatic [15:0] existing(input [5:0] word);
        case (word)
            MSC: existing = 16'h07FF;
            SMPL: existing = 16'h1FFF;
            SENS: existing = 16'h07FF;
            default: existing = 16'hFFFF;
        endcase
    endfunction

    // --- Sample instants ------------------------------------------------------------------------
    reg [63:0] phase;
    integer fast_count, base_count;
    reg ready;
    integer ready_left;
    localparam longint STEP = RATE_HZ * FAST * (1_000_000 + PPM);
    localparam longint FULL = CLOCK_HZ * 1_000_000;
    reg fast_tick, base_tick, instant, falls, rises;
    integer decimation;
    integer value[0:7];
    integer v0, v1, v2, v3, v4, v5, v6, v7;

    // --- Serial port --------------------------------------------------------------------------
    reg cs_before, sclk_before, rst_before;
    integer since_cs, since_sclk, since_rst, bits, delay;
    reg [15:0] shift_in, shift_out, answer;
    reg bit_out, bit_next, die;
    reg known;  // no: a reset has touched this frame or pause, so it proves nothing
    reg [31:0] random;

    // What others read changes after the clock's edge, whatever the order of the blocks.
    reg log_done_v, active;
    reg [31:0] line_v, instants_v, frames_v, violations_v;

    task automatic complain(input [8*40-1:0] what, input integer found, input integer wanted);
        $display("adis16385: violation: %0s: %0d, wanted %0d", what, found, wanted);
        violations_v = violations_v + 1;
    endtask

    task automatic defaults;
        memory[MSC] = 16'h0006;
        memory[SMPL] = 16'h0001;
        memory[SENS] = 16'h0402;
    endtask

    task automatic restart;
        for (n = 0; n < 64; n = n + 1) memory[n] = 16'h0;
        defaults;
        memory[6'h29] = 16'h0123;  // lot
        memory[6'h2A] = 16'h4567;
        memory[6'h2C] = 16'h0042;  // serial number
        alive = 1'b0;
        waiting = STARTUP;
        diag_held = 16'h0;
        answer = 16'h0;
        known = 1'b0;
        bit_out = 1'b1;
        ready = 1'b0;
        base_count = 0;
    endtask

    initial begin
        dout = 1; dio1 = 0; log_done = 0; line = 0; instants = 0; frames = 0; violations = 0;
        log_done_v = 0; line_v = 0; instants_v = 0; frames_v = 0; violations_v = 0;
        scheduled = 0; on = 0; phase = 0; fast_count = 0; die = 0; random = 32'h1234_5678;
        cs_before = 1; sclk_before = 1; rst_before = 0;
        since_cs = 0; since_sclk = 0; since_rst = 0; bits = 0; delay = 0;
        shift_in = 0; shift_out = 0; bit_next = 1; ready_left = 0;
        for (n = 0; n < 8; n = n + 1) value[n] = 0;
        restart;
    end

    // All in one block, in the order in which things happen: the state is of this model alone.
    /* verilator lint_off BLKSEQ */
    always @(posedge clk) begin
        random = random ^ (random << 13);
        random = random ^ (random >> 17);
        random = random ^ (random << 5);

        // Time.
        on = fault | scheduled;
        decimation = 1 << (memory[SMPL][11:8] > 12 ? 12 : memory[SMPL][11:8]);
        fast_tick = phase >= FULL;
        base_tick = fast_tick && fast_count == 0;
        instant = base_tick && base_count == 0;
        phase = (fast_tick ? phase - FULL : phase) + STEP;
        if (ready_left != 0) ready_left = ready_left - 1;
        else ready = 1'b0;
        if (fast_tick) begin
            fast_count = fast_count == FAST - 1 ? 0 : fast_count + 1;
            if (on[5] && alive) begin
                ready = 1'b1;
                ready_left = READY_PULSE - 1;
            end
        end
        if (base_tick) base_count = (base_count + 1) & (decimation - 1);
        if (instant) begin
            instants_v = instants_v + 1;
            scheduled = 16'h0;
            for (n = 0; n < entries; n = n + 1)
                if (instants_v - 1 >= first_of[n] && instants_v - 1 <= last_of[n])
                    scheduled[bit_of[n]] = 1'b1;
            on = fault | scheduled;
            // The world goes on during a later reset, but does not begin before the first start.
            if ((alive || line_v != 0) && !(hold_log && line_v != 0)
                && log_file != 0 && !log_done_v) begin
                // By variables: Icarus does not read into an element of an array.
                got = $fscanf(log_file, "%d %d %d %d %d %d %d %d", v0, v1, v2, v3, v4, v5, v6, v7);
                if (got == 8) begin
                    value[0] = v0; value[1] = v1; value[2] = v2; value[3] = v3;
                    value[4] = v4; value[5] = v5; value[6] = v6; value[7] = v7;
                end
                if (got == 8) line_v = line_v + 1;
                else begin
                    log_done_v = 1'b1;
                    if (got > 0) $display("adis16385: log: line %0d has %0d of 8 numbers",
                                          line_v + 1, got);
                end
            end
            if (alive) begin
                for (n = 0; n < 6; n = n + 1) memory[2 + n] = value[n][15:0];
                if (on[7]) memory[2] = 16'd24000;
                // Twelve bits are data; what the others hold is not said: a flag, as in siblings.
                memory[TEMP] = {4'h8, value[6][11:0]};
                diag_held = diag_held | value[7][15:0];
                ready = 1'b1;
                ready_left = READY_PULSE - 1;
            end
            if (on[8]) die = 1'b1;
        end
        if (on[11]) defaults;
        if (!memory[MSC][10]) testing = SELF_TEST;
        else if (testing != 0) testing = testing - 1;
        else begin
            memory[MSC][10] = 1'b0;
            diag_held = diag_held | failing;
        end

        // Frames.
        falls = cs_before && !cs_n;
        rises = !cs_before && cs_n;
        since_cs = since_cs + 1;
        since_sclk = since_sclk + 1;
        if (delay != 0) begin
            delay = delay - 1;
            if (delay == 0) bit_out = bit_next;
        end
        if (falls) begin
            if (known && since_cs < STALL_MIN) complain("short stall", since_cs, STALL_MIN);
            if (!sclk) complain("clock low at the start of a frame", 0, 1);
            since_cs = 0;
            since_sclk = 0;
            bits = 0;
            shift_out = answer ^ (on[10] ? 16'h1 << random[3:0] : 16'h0);
            known = 1'b1;
        end else if (sclk != sclk_before) begin
            if (cs_n) complain("clock edge outside a frame", 1, 0);
            else if (known) begin
                if (bits == 0 && !sclk) begin
                    if (since_cs < SETUP_MIN) complain("short setup", since_cs, SETUP_MIN);
                end else if (since_sclk < HALF_MIN)
                    complain("short half period", since_sclk, HALF_MIN);
            end
            since_sclk = 0;
            if (!cs_n && !sclk) begin
                {bit_next, shift_out} = {shift_out, 1'b1};
                delay = DOUT_DELAY;
                if (DOUT_DELAY == 0) bit_out = bit_next;
            end
            if (!cs_n && sclk) begin
                shift_in = {shift_in[14:0], din};
                bits = bits + 1;
                if (die && bits == 8 && alive) begin
                    die = 1'b0;
                    restart;
                end
            end
        end
        if (rises) begin
            if (known && since_sclk < HALF_MIN)
                complain("short last half period", since_sclk, HALF_MIN);
            since_cs = 0;
            if (known && bits != 16) begin
                complain("bits in a frame", bits, 16);
                diag_held = diag_held | 16'h0008;
            end
            if (bits == 16) begin
                frames_v = frames_v + 1;
                if (known && alive) execute;
            end
            known = 1'b1;
        end

        // Life.
        since_rst = since_rst + 1;
        if (!alive && rst_n) begin
            if (waiting != 0) waiting = waiting - 1;
            else alive = 1'b1;
        end
        if (rst_n != rst_before) begin
            if (rst_n && since_rst < RESET_MIN) complain("short reset", since_rst, RESET_MIN);
            since_rst = 0;
        end
        if (!rst_n) restart;
        cs_before = cs_n;
        sclk_before = sclk;
        rst_before = rst_n;

        dout <= (cs_n || on[1] || on[3]) ? 1'b1 : on[2] ? 1'b0 : bit_out;
        active = ready && alive && memory[MSC][2] && !memory[MSC][0] && !on[4];
        dio1 <= on[1] ? 1'b0 : alive && memory[MSC][2] && !memory[MSC][1] ? !active : active;
        log_done <= log_done_v;
        line <= line_v;
        instants <= instants_v;
        frames <= frames_v;
        violations <= violations_v;
    end

    task automatic execute;
        if (shift_in[15]) begin
            answer = 16'h5A5A;  // what a write answers is not said
            if (!writable(shift_in[14:9]))
                complain("write to a register that is read-only", shift_in[14:8], 0);
            else if (!on[9]) begin
                if (shift_in[14:8] == {GLOB, 1'b0}) begin
                    if (shift_in[7]) restart;
                end else begin
                    if (shift_in[8]) memory[shift_in[14:9]][15:8] = shift_in[7:0];
                    else memory[shift_in[14:9]][7:0] = shift_in[7:0];
                    memory[shift_in[14:9]] = memory[shift_in[14:9]] & existing(shift_in[14:9]);
                end
            end
        end else begin
            case (shift_in[14:9])
                DIAG: begin
                    answer = diag_held | (on[6] ? 16'h0300 : 16'h0) | (on[7] ? 16'h0010 : 16'h0)
                             | (on[12] ? 16'h0008 : 16'h0);
                    diag_held = 16'h0;
                end
                PROD: answer = on[0] ? 16'h4000 : 16'h4001;
                default: answer = memory[shift_in[14:9]];
            endcase
        end
    endtask
    /* verilator lint_on BLKSEQ */
endmodule
`default_nettype wire
