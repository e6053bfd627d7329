// The reader of the ADIS16385 against a device that does whatever it likes; written down for a
// model to judge.
//
// Plusargs: +seed=N, +frames=N ends the run.
//
// Printed, time first; inputs of the reader:
//   time d                data-ready rises at the pin
//   time c                chip select falls
//   time f mosi miso      chip select rises: words of the frame, as the lines carried them
//   time x                restart is high
//   time e 0|1            enable changes to
//   time s settings       msc_ctrl, smpl_prd, sens_avg change to
// and outputs:
//   time r 0|1            reset pin changes to
//   time E events         a cycle with events
//   time F flags          flags change to
//   time S stamp number w0 .. w7   a sample, read in the last cycles of its hold time
// `violation` lines: rules of timing that are broken. At the end: `end frames cycles`.
module adis16385_fuzz #(
    parameter HALF = 3,
    parameter SETUP = 3,
    parameter STALL = 31,
    parameter HOLD = 29,
    parameter PERIOD = 2000
) (
    input wire clk,
    input wire rst
);
    wire cs_n, sclk, mosi, reset_n, sample;
    wire [15:0] word, number;
    wire [31:0] stamp;
    wire [7:0] flags;
    wire [8:0] events;
    reg [31:0] now;
    reg [2:0] index;
    reg [47:0] settings;
    reg miso, data_ready, restart, enable, miso_next, ready_next, enable_next;
    reg [47:0] settings_next;

    adis16385 reader (
        .clk(clk), .rst(rst), .cs_n(cs_n), .sclk(sclk), .mosi(mosi), .miso(miso),
        .reset_n(reset_n), .data_ready(data_ready), .\time (now), .enable(enable),
        .restart(restart), .msc_ctrl(settings[47:32]), .smpl_prd(settings[31:16]),
        .sens_avg(settings[15:0]), .sample(sample), .index(index), .word(word), .stamp(stamp),
        .number(number), .flags(flags), .events(events));

    reg [63:0] random;
    function automatic [31:0] roll(input [31:0] n);
        random = random ^ (random << 13);
        random = random ^ (random >> 7);
        random = random ^ (random << 17);
        roll = random[62:31] % n;
    endfunction

    integer frames, limit, edge_left, ready_left, edges_mode, answers_mode, episode_left, off_left;
    integer since_cs, since_sclk, bits, delay, delay_now, n;
    reg [15:0] answer, sending, driven, heard, msc, smpl, sens, words[0:7];
    reg [7:0] flags_before;
    reg cs_before, sclk_before, reset_before, bit_next, first_cs;
    integer hold_left;
    reg [31:0] sample_time;

    function automatic [15:0] measured(input integer dummy);
        reg [31:0] which;
        which = roll(8);
        case (which)
            0: measured = 16'd24000 + roll(3) - 1;
            1: measured = -16'd24000 + roll(3) - 1;
            2: measured = 16'd20000 + roll(3) - 1;
            3: measured = -16'd20000 + roll(3) - 1;
            4: measured = roll(65536);
            default: measured = roll(16384) - 16'd8192;
        endcase
    endfunction

    function automatic [15:0] obey(input [15:0] command);
        reg [31:0] chance;
        obey = roll(65536);
        if (command[15]) begin
            case (command[14:8])
                7'h34: msc[7:0] = command[7:0];
                7'h35: msc[15:8] = command[7:0];
                7'h36: smpl[7:0] = command[7:0];
                7'h37: smpl[15:8] = command[7:0];
                7'h38: sens[7:0] = command[7:0];
                7'h39: sens[15:8] = command[7:0];
                default: begin end
            endcase
        end else begin
            case (command[14:8])
                7'h04, 7'h06, 7'h08, 7'h0A, 7'h0C, 7'h0E: obey = measured(0);
                7'h10: obey = roll(65536);
                7'h34: obey = msc;
                7'h36: obey = smpl;
                7'h38: obey = sens;
                7'h3C: begin
                    chance = roll(16);
                    obey = chance == 0 ? roll(65536) : chance == 1 ? 16'h0001 << roll(16) : 16'h0;
                end
                7'h56: obey = answers_mode == 5 ? 16'h4000 : 16'h4001;
                default: begin end
            endcase
        end
    endfunction

    task automatic forget;
        msc = 16'h0006;
        smpl = 16'h0001;
        sens = 16'h0402;
        answer = 16'h0;
    endtask

    initial begin
        if (!$value$plusargs("frames=%d", limit)) limit = 1000;
        if (!$value$plusargs("seed=%d", n)) n = 1;
        random = 64'h9E3779B97F4A7C15 ^ n;
        now = 0; index = 0; settings = 48'h000600010402;
        miso = 1; data_ready = 0; restart = 0; enable = 1;
        miso_next = 1; ready_next = 0; enable_next = 1; settings_next = settings;
        frames = 0; edge_left = PERIOD; ready_left = 0; edges_mode = 0; answers_mode = 0;
        episode_left = 20 * PERIOD; off_left = 0;
        since_cs = 0; since_sclk = 0; bits = 0; delay = 0; delay_now = 1;
        sending = 0; driven = 0; heard = 0;
        flags_before = 0; cs_before = 1; sclk_before = 1; reset_before = 0; bit_next = 1;
        first_cs = 1; hold_left = 0; sample_time = 0;
        forget;
    end

    /* verilator lint_off BLKSEQ */
    always @(posedge clk) if (!rst) begin
        // What was there in this cycle.
        if (cs_before && !cs_n) begin
            $display("%0d c", now);
            if (!first_cs && since_cs < STALL) $display("violation: stall %0d", since_cs);
            if (!sclk || !sclk_before) $display("violation: sclk at the start");
            first_cs = 0;
        end
        if (sclk != sclk_before) begin
            if (cs_n || cs_before) $display("violation: sclk outside");
            else if (!sclk && bits == 0 && since_cs != SETUP)
                $display("violation: setup %0d", since_cs);
            else if (!(!sclk && bits == 0) && since_sclk != HALF)
                $display("violation: half %0d", since_sclk);
        end
        if (!cs_before && cs_n) begin
            if (since_sclk != HALF) $display("violation: last half %0d", since_sclk);
            if (bits != 16) $display("violation: bits %0d", bits);
            $display("%0d f %h %h", now, heard, driven);
            frames = frames + 1;
        end
        if (reset_n != reset_before) $display("%0d r %0d", now, reset_n);
        if (restart) $display("%0d x", now);
        if (events != 0) $display("%0d E %h", now, events);
        if (flags != flags_before) $display("%0d F %h", now, flags);

        // The sample, read as late as is allowed.
        if (hold_left != 0) begin
            if (hold_left <= 8) words[8 - hold_left] = word;
            hold_left = hold_left - 1;
            if (hold_left == 0)
                $display("%0d S %0d %0d %h %h %h %h %h %h %h %h", sample_time, stamp, number,
                         words[0], words[1], words[2], words[3], words[4], words[5], words[6],
                         words[7]);
        end
        if (sample) begin
            if (hold_left != 0) $display("violation: sample within the hold time");
            sample_time = now;
            hold_left = HOLD - 1;  // cycles after this one
        end
        index <= hold_left <= 8 && hold_left != 0 ? 8 - hold_left : 0;

        // The device.
        since_cs = since_cs + 1;
        since_sclk = since_sclk + 1;
        if (delay != 0) begin
            delay = delay - 1;
            if (delay == 0) miso_next = bit_next;
        end
        if (cs_before != cs_n) begin
            since_cs = 1;
            if (!cs_n) begin
                bits = 0;
                delay_now = roll(2 * HALF - 3);
                sending = answer;
                case (answers_mode)
                    1: if (roll(12) == 0) sending = answer ^ (16'h1 << roll(16));
                    2: sending = roll(65536);
                    3: sending = 16'h0;
                    4: sending = 16'hFFFF;
                    default: begin end
                endcase
                driven = sending;
            end else begin
                answer = obey(heard);
                miso_next = roll(2);
            end
        end
        if (sclk != sclk_before) begin
            since_sclk = 1;
            if (!sclk) begin
                bit_next = sending[15];
                sending = sending << 1;
                delay = delay_now;
                if (delay == 0) miso_next = bit_next;
                else miso_next = roll(2);
            end else begin
                heard = {heard[14:0], mosi};
                bits = bits + 1;
            end
        end
        if (!reset_n) forget;
        if (roll(60_000) == 0) forget;

        // Data-ready, and what the reader is told.
        if (ready_left != 0) begin
            ready_left = ready_left - 1;
            if (ready_left == 0) ready_next = 0;
        end
        edge_left = edge_left - 1;
        if (edge_left <= 0 && !ready_next && !data_ready) begin
            case (edges_mode)
                0: edge_left = PERIOD - 20 + roll(41);
                1: edge_left = 20 + roll(600);
                2: edge_left = 600 + roll(2 * PERIOD);
                default: edge_left = 12 * PERIOD + roll(40 * PERIOD);
            endcase
            ready_left = 1 + roll(edges_mode == 1 ? 15 : 100);
            ready_next = 1;
            $display("%0d d", now + 1);
        end
        episode_left = episode_left - 1;
        if (episode_left <= 0) begin
            episode_left = 500 + roll(20 * PERIOD);
            n = roll(10);
            edges_mode = n < 5 ? 0 : n < 7 ? n - 4 : 3;
            n = roll(12);
            answers_mode = n < 7 ? 0 : n - 6;
            if (edge_left > 4 * PERIOD) edge_left = 1 + roll(4 * PERIOD);
        end
        if (off_left != 0) begin
            off_left = off_left - 1;
            if (off_left == 0) begin
                enable_next = 1;
                $display("%0d e 1", now + 1);
            end
        end else if (roll(200_000) == 0) begin
            off_left = 1 + roll(4000);
            enable_next = 0;
            $display("%0d e 0", now + 1);
        end
        if (roll(50_000) == 0) begin
            settings_next = {16'h0006, 6'h0, 2'(roll(3)), 8'h01, 5'h0, 3'h1 << roll(3), 5'h0,
                        3'(roll(7))};
            $display("%0d s %h", now + 1, settings_next);
        end

        // What the reader sees changes after the clock's edge.
        miso <= miso_next;
        data_ready <= ready_next;
        restart <= roll(60_000) == 0;
        enable <= enable_next;
        settings <= settings_next;
        now <= now + 1;
        cs_before = cs_n;
        sclk_before = sclk;
        reset_before = reset_n;
        flags_before = flags;
        if (frames >= limit) begin
            $display("end %0d %0d", frames, now);
            $finish;
        end
    end
    /* verilator lint_on BLKSEQ */
endmodule
