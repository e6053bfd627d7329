// The reader of the ADIS16385 and the device, pin to pin; clocks scaled down by parameters.
//
// Plusargs: those of the device; +samples=N and +cycles=N end the run; +restart=CYCLE restarts the
// reader there; +command=HEX offers a command from cycle +command_at=CYCLE on; +settings=HEX sets msc_ctrl, smpl_prd, sens_avg; +fault=HEX and +fault_from=CYCLE,
// +fault_to=CYCLE switch faults on in between.
//
// Printed, time first:
//   time S stamp number line w0 .. w7   a good sample, words in quarters (hex); `line` of the log
//                                       at its data-ready edge
//   time E events flags                 a cycle with events (hex)
//   time F flags                        flags have changed (hex)
//   time D                              data-ready edge at the pin
//   time C                              chip select has risen
//   time R 0|1                          reset pin has changed
//   time L temperature diag_stat        one of the latest words has changed (hex)
// and at the end: `end frames instants violations`.
module adis16385_bench #(
    parameter CLOCK_HZ = 1_000_000,
    parameter RATE_HZ = 500,
    parameter PPM = 0,
    parameter STARTUP = 2500,
    parameter READY_PULSE = 50,
    parameter STALL_MIN = 30,
    parameter HALF_MIN = 3,
    parameter SETUP_MIN = 3,
    parameter RESET_MIN = 100,
    parameter DOUT_DELAY = 1
) (
    input wire clk,
    input wire rst
);
    wire cs_n, sclk, mosi, miso, data_ready, reset_n, sample, log_done;
    wire [17:0] word;
    wire [15:0] number, temperature, diag_stat;
    wire [31:0] stamp, line, instants, frames, violations;
    wire [7:0] flags;
    wire [8:0] events;
    reg [31:0] now;
    reg [2:0] index;
    reg [47:0] settings;
    reg [15:0] command;
    reg command_valid;
    wire command_ready;
    integer command_at;
    reg [15:0] fault_mask;
    integer samples, limit_samples, limit_cycles, restart_at, fault_from, fault_to, reading;
    reg [7:0] flags_before;
    reg [31:0] latest_before;
    reg ready_before, cs_before, reset_before;
    reg [31:0] line_at_edge, line_now, sample_time;
    reg [17:0] words[0:7];

    adis16385 reader (
        .clk(clk), .rst(rst), .cs_n(cs_n), .sclk(sclk), .mosi(mosi), .miso(miso),
        .reset_n(reset_n), .data_ready(data_ready), .\time (now),
        .restart(now == restart_at), .msc_ctrl(settings[47:32]), .smpl_prd(settings[31:16]),
        .sens_avg(settings[15:0]), .command__payload(command), .command__valid(command_valid),
        .command__ready(command_ready), .sample(sample), .index(index), .word(word), .stamp(stamp),
        .number(number), .temperature(temperature), .diag_stat(diag_stat), .flags(flags), .events(events));

    adis16385_device #(
        .CLOCK_HZ(CLOCK_HZ), .RATE_HZ(RATE_HZ), .PPM(PPM), .STARTUP(STARTUP),
        .READY_PULSE(READY_PULSE), .STALL_MIN(STALL_MIN), .HALF_MIN(HALF_MIN),
        .SETUP_MIN(SETUP_MIN), .RESET_MIN(RESET_MIN), .DOUT_DELAY(DOUT_DELAY)
    ) device (
        .clk(clk), .cs_n(cs_n), .sclk(sclk), .din(mosi), .dout(miso), .dio1(data_ready),
        .rst_n(reset_n), .hold_log(~flags[0]),
        .fault(now >= fault_from && now < fault_to ? fault_mask : 16'h0),
        .log_done(log_done), .line(line), .instants(instants), .frames(frames),
        .violations(violations));

    initial begin
        if (!$value$plusargs("samples=%d", limit_samples)) limit_samples = 2147483647;
        if (!$value$plusargs("cycles=%d", limit_cycles)) limit_cycles = 2147483647;
        if (!$value$plusargs("restart=%d", restart_at)) restart_at = -1;
        if (!$value$plusargs("settings=%h", settings)) settings = 48'h000600010402;
        if (!$value$plusargs("command=%h", command)) command = 0;
        if (!$value$plusargs("command_at=%d", command_at)) command_at = -1;
        command_valid = 0;
        if (!$value$plusargs("fault=%h", fault_mask)) fault_mask = 0;
        if (!$value$plusargs("fault_from=%d", fault_from)) fault_from = 0;
        if (!$value$plusargs("fault_to=%d", fault_to)) fault_to = 2147483647;
        now = 0; index = 0; samples = 0; reading = 0;
        flags_before = 0; latest_before = 0; ready_before = 0; cs_before = 1; reset_before = 0;
        line_at_edge = 0; line_now = 0; sample_time = 0;
    end

    always @(posedge clk) if (!rst) begin
        now <= now + 1;
        if (command_ready) command_valid <= 0;
        if (now == command_at) command_valid <= 1;
        flags_before <= flags;
        latest_before <= {temperature, diag_stat};
        ready_before <= data_ready;
        cs_before <= cs_n;
        reset_before <= reset_n;
        if (data_ready && !ready_before) $display("%0d D", now);
        if (data_ready && !ready_before) line_now <= line;
        if (cs_n && !cs_before) $display("%0d C", now);
        if (reset_n != reset_before) $display("%0d R %0d", now, reset_n);
        if ({temperature, diag_stat} != latest_before)
            $display("%0d L %h %h", now, temperature, diag_stat);
        if (flags != flags_before) $display("%0d F %h", now, flags);
        if (events != 0) $display("%0d E %h %h", now, events, flags);
        if (sample) begin
            sample_time <= now;
            line_at_edge <= line_now;
            reading <= 1;
            index <= 0;
        end
        if (reading != 0) begin
            words[index] <= word;
            index <= index + 1;
            reading <= index == 7 ? 0 : 1;
            if (index == 7) begin
                $display("%0d S %0d %0d %0d %h %h %h %h %h %h %h %h", sample_time, stamp, number,
                         line_at_edge, words[0], words[1], words[2], words[3], words[4], words[5],
                         words[6], word);
                samples <= samples + 1;
            end
        end
        if (samples >= limit_samples || now >= limit_cycles) begin
            $display("end %0d %0d %0d", frames, instants, violations);
            $finish;
        end
    end
endmodule
