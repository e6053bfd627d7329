// The whole board: the system with both devices at its pins and a host on its serial line.
//
// Plusargs: +updates=N ends the run after N updates (and the frame of the last one), +cycles=N after
// N cycles; +host=FILE has what the host sends, lines `cycle byte` (byte in hex); +keep leaves the
// end to others: `done` rises and no $finish follows. The devices have plusargs of their own.
//
// Written to trace.txt, cycle first:
//   cycle R line       data-ready has risen at the pin; line of the log, from 1 on
//   cycle S            a whole sample is in the reader's buffer
//   cycle U n          update n is in the registers
//   cycle B byte       the stop bit of a byte from the host line has begun (byte in hex)
//   cycle E            a byte without stop bit
//   cycle N events     pulses of the counted events, as bits (hex)
//   cycle F adis hmr   faults of the devices that are on, as bits (hex)
//   cycle V n          violations of the timing that the ADIS16385 saw, at the end
//   cycle L counts a b c slot  a line of the compass is good

`timescale 1ns/1ps

module bench #(
    parameter CLOCK_HZ = 100_000_000,
    parameter HOST_DIVISOR = 109,
    parameter ADIS_RATE = 1024,
    parameter ADIS_STARTUP_CYCLES = 100_000,
    parameter ADIS_READY_CYCLES = 5_000,
    parameter ADIS_STALL_MIN = 1_600,
    parameter ADIS_HALF_MIN = 50,
    parameter ADIS_DOUT_DELAY = 10,
    parameter HMR_DIVISOR = 5208,
    parameter HMR_LINE_CYCLES = 12_500_000,
    parameter HMR_STARTUP_CYCLES = 1_000_000,
    parameter HMR_ANSWER_CYCLES = 100_000
) (
    // What cocotb drives and sees.
    input wire clk /*verilator public_flat_rw*/,
    input wire rst /*verilator public_flat_rw*/,
    output reg done /*verilator public_flat_rw*/,
    output reg byte_strobe /*verilator public_flat_rw*/,  // changes with every byte from the board
    output reg [7:0] byte_heard /*verilator public_flat_rw*/
);
    wire adis_cs_n, adis_sclk, adis_mosi, adis_miso, adis_data_ready, adis_reset_n;
    wire hmr_rx, hmr_tx, host_tx;
    reg host_rx;

    // By a register: what depends on an input is computed twice in every cycle.
    reg reset = 1;
    always @(posedge clk) reset <= rst;

    system dut (
        .clk(clk), .rst(reset),
        .adis_cs_n(adis_cs_n), .adis_sclk(adis_sclk), .adis_mosi(adis_mosi), .adis_miso(adis_miso),
        .adis_data_ready(adis_data_ready), .adis_reset_n(adis_reset_n),
        .hmr_rx(hmr_rx), .hmr_tx(hmr_tx),
        .host_rx(host_rx), .host_tx(host_tx),
        .led_running(), .led_fault()
    );
    reg seen_running;
    wire log_done;
    wire [31:0] adis_line, adis_violations;
    adis16385_device #(
        .CLOCK_HZ(CLOCK_HZ), .RATE_HZ(ADIS_RATE), .STARTUP(ADIS_STARTUP_CYCLES),
        .READY_PULSE(ADIS_READY_CYCLES), .STALL_MIN(ADIS_STALL_MIN), .HALF_MIN(ADIS_HALF_MIN),
        .SETUP_MIN(1), .RESET_MIN(100), .DOUT_DELAY(ADIS_DOUT_DELAY)
    ) adis (
        .clk(clk), .cs_n(adis_cs_n), .sclk(adis_sclk), .din(adis_mosi), .dout(adis_miso),
        .dio1(adis_data_ready), .rst_n(adis_reset_n), .hold_log(!seen_running),
        .fault(16'd0), .log_done(log_done), .line(adis_line), .instants(), .frames(),
        .violations(adis_violations)
    );
    wire [31:0] hmr_slot;
    hmr3300_device #(
        .BIT(HMR_DIVISOR), .LINE(HMR_LINE_CYCLES), .STARTUP(HMR_STARTUP_CYCLES),
        .ANSWER(HMR_ANSWER_CYCLES), .GLITCH(HMR_DIVISOR / 50)
    ) hmr (
        .clk(clk), .rst(reset || !seen_running), .rx(hmr_tx), .tx(hmr_rx), .fault(12'd0),
        .slot(hmr_slot)
    );

    // -- host line: what it sends --------------------------------------------------------------
    integer fhost, scanned, host_at, host_bit, host_timer;
    reg [7:0] host_byte;
    reg [9:0] host_frame;
    reg host_due;
    string host_name;

    task next_host;
        begin
            host_due = 0;
            if (fhost != 0) begin
                scanned = $fscanf(fhost, "%d %h", host_at, host_byte);
                host_due = scanned == 2;
            end
        end
    endtask

    // -- what is written down ------------------------------------------------------------------
    integer trace, cycle, updates, limit_updates, limit_cycles, last_edge;
    integer listen_timer, listen_bit, quiet, since_update;
    reg [7:0] heard;
    reg listening, was_ready, keep;
    reg [31:0] was_faults;

    initial begin
        done = 0; byte_strobe = 0; byte_heard = 0;
        if (!$value$plusargs("updates=%d", limit_updates)) limit_updates = 2147483647;
        if (!$value$plusargs("cycles=%d", limit_cycles)) limit_cycles = 2147483647;
        keep = $test$plusargs("keep") != 0;
        fhost = 0;
        if ($value$plusargs("host=%s", host_name)) fhost = $fopen(host_name, "r");
        trace = $fopen("trace.txt", "w");
        cycle = 0; updates = 0;
        host_rx = 1; host_bit = 10; host_timer = 0; host_frame = 10'h3ff;
        listening = 0; listen_timer = 0; listen_bit = 0; quiet = 0; since_update = 0;
        seen_running = 0;
        was_ready = 0; was_faults = 0;
        next_host;
    end

    always @(posedge clk) begin
        cycle <= cycle + 1;

        // Host to board.
        if (host_bit < 10) begin
            if (host_timer == 0) begin
                host_bit <= host_bit + 1;
                host_rx <= host_bit == 9 ? 1'b1 : host_frame[host_bit + 1];
                host_timer <= HOST_DIVISOR - 1;
            end else host_timer <= host_timer - 1;
        end else if (host_due && cycle >= host_at) begin
            host_frame <= {1'b1, host_byte, 1'b0};
            host_rx <= 0;
            host_bit <= 0;
            host_timer <= HOST_DIVISOR - 1;
            next_host;
        end

        if (!reset) begin
            // Board to host: bytes, each in the middle of its bits.
            if (!listening) begin
                quiet <= quiet + 1;
                if (host_tx === 1'b0) begin
                    listening <= 1;
                    listen_timer <= HOST_DIVISOR + HOST_DIVISOR / 2 - 1;
                    listen_bit <= 0;
                end
            end else if (listen_timer != 0) listen_timer <= listen_timer - 1;
            else begin
                listen_timer <= HOST_DIVISOR - 1;
                if (listen_bit == 8) begin
                    if (host_tx === 1'b1) begin
                        $fwrite(trace, "%0d B %02x\n", cycle, heard);
                        byte_heard <= heard;
                        byte_strobe <= !byte_strobe;
                    end else $fwrite(trace, "%0d E\n", cycle);
                    listening <= 0;
                    quiet <= 0;
                end else begin
                    heard[listen_bit] <= host_tx;
                    listen_bit <= listen_bit + 1;
                end
            end

            // Pins of the ADIS16385.
            was_ready <= adis_data_ready;
            if (adis_data_ready && !was_ready) $fwrite(trace, "%0d R %0d\n", cycle, adis_line);

            if ({adis.on, 4'd0, hmr.active} != was_faults) begin
                $fwrite(trace, "%0d F %h %h\n", cycle, adis.on, hmr.active);
                was_faults <= {adis.on, 4'd0, hmr.active};
            end

            // Both logs begin when the inertial sensor is first running.
            if (dut.probe_running === 1'b1) seen_running <= 1;

            // Inside.
            if (dut.probe_sample === 1'b1) $fwrite(trace, "%0d S\n", cycle);
            if (dut.probe_events != 0) $fwrite(trace, "%0d N %h\n", cycle, dut.probe_events);
            if (dut.probe_line === 1'b1)
                $fwrite(trace, "%0d L %0d %0d %0d %0d %0d\n", cycle, dut.probe_counts,
                        $signed(dut.probe_value0), $signed(dut.probe_value1), $signed(dut.probe_value2),
                        hmr_slot);
            if (dut.probe_updated === 1'b1) begin
                $fwrite(trace, "%0d U %0d\n", cycle, updates);
                updates <= updates + 1;
                since_update <= 0;
            end else since_update <= since_update + 1;
            if (^{adis_cs_n, adis_sclk, adis_mosi, adis_reset_n, hmr_tx, host_tx,
                  dut.probe_updated} === 1'bx) begin
                $fwrite(trace, "%0d X\n", cycle);
                done <= 1;
            end

            // The end: all updates asked for, and the line quiet again.
            if (cycle >= limit_cycles
                || (updates >= limit_updates && !listening && quiet > 20 * HOST_DIVISOR
                    && since_update > 20 * HOST_DIVISOR)) begin
                if (!done) begin
                    $fwrite(trace, "%0d V %0d\n", cycle, adis_violations);
                    $fclose(trace);
                end
                done <= 1;
            end
            if (done && !keep) $finish;
        end
    end
endmodule
