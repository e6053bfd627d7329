// The whole board with a soft core: both sensors at the pins, eyes on memory and console.
//
// Arguments: updates, after (cycles to go on after the last one), watch_a, watch_b (byte addresses
// of two places of WATCH_A and WATCH_B words, 0: none); those of devices and console. It prints
//   S cycle            a whole sample is in the reader's buffer
//   U cycle            an update is in the registers
//   A|B cycle k word   word k of a place is written
//   W cycle            the watchdog restarts the processor
module bench #(
    parameter CLOCK_HZ = 100_000_000,
    parameter HOST_DIVISOR = 109,
    parameter CONSOLE_DIVISOR = 8,
    parameter WATCH_A = 63,
    parameter WATCH_B = 21,
    parameter ADIS_RATE = 1024,
    parameter ADIS_PPM = 0,
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
    input clk,
    input rst
);
    wire adis_cs_n, adis_sclk, adis_mosi, adis_miso, adis_data_ready, adis_reset_n;
    wire hmr_rx, hmr_tx, host_tx, console_tx, console_rx;
    reg seen_running, restarted;

    attitude_soc dut (
        .clk(clk), .rst(rst),
        .adis_cs_n(adis_cs_n), .adis_sclk(adis_sclk), .adis_mosi(adis_mosi), .adis_miso(adis_miso),
        .adis_data_ready(adis_data_ready), .adis_reset_n(adis_reset_n),
        .hmr_rx(hmr_rx), .hmr_tx(hmr_tx), .host_rx(1'b1), .host_tx(host_tx),
        .console_rx(console_rx), .console_tx(console_tx), .led_running(), .led_fault()
    );
    adis16385_device #(
        .CLOCK_HZ(CLOCK_HZ), .RATE_HZ(ADIS_RATE), .PPM(ADIS_PPM), .STARTUP(ADIS_STARTUP_CYCLES),
        .READY_PULSE(ADIS_READY_CYCLES), .STALL_MIN(ADIS_STALL_MIN), .HALF_MIN(ADIS_HALF_MIN),
        .SETUP_MIN(1), .RESET_MIN(100), .DOUT_DELAY(ADIS_DOUT_DELAY)
    ) adis (
        .clk(clk), .cs_n(adis_cs_n), .sclk(adis_sclk), .din(adis_mosi), .dout(adis_miso),
        .dio1(adis_data_ready), .rst_n(adis_reset_n), .hold_log(!seen_running),
        .fault(16'd0), .log_done(), .line(), .instants(), .frames(), .violations()
    );
    hmr3300_device #(
        .BIT(HMR_DIVISOR), .LINE(HMR_LINE_CYCLES), .STARTUP(HMR_STARTUP_CYCLES),
        .ANSWER(HMR_ANSWER_CYCLES), .GLITCH(HMR_DIVISOR / 50)
    ) hmr (
        .clk(clk), .rst(rst || !seen_running), .rx(hmr_tx), .tx(hmr_rx), .fault(12'd0), .slot()
    );

    integer cycle, updates, limit, left, watch_a, watch_b;
    wire [31:0] address = dut.soc.ram.dbus__adr * 4;
    wire write = dut.soc.ram.dbus__cyc && dut.soc.ram.dbus__stb && dut.soc.ram.dbus__we
                 && dut.soc.ram.dbus__ack;

    initial begin
        if (!$value$plusargs("updates=%d", limit)) limit = 1;
        if (!$value$plusargs("after=%d", left)) left = 5000;
        if (!$value$plusargs("watch_a=%d", watch_a)) watch_a = 0;
        if (!$value$plusargs("watch_b=%d", watch_b)) watch_b = 0;
        cycle = 0; updates = 0; seen_running = 0; restarted = 0;
    end

    always @(posedge clk) begin
        cycle <= cycle + 1;
        if (!rst) begin
            if (dut.probe_running) seen_running <= 1;
            if (dut.probe_sample) $display("S %0d", cycle);
            if (dut.probe_updated) begin
                $display("U %0d", cycle);
                updates <= updates + 1;
            end
            if (write && watch_a != 0 && address >= watch_a && address < watch_a + 4 * WATCH_A)
                $display("A %0d %0d %h", cycle, (address - watch_a) / 4, dut.soc.ram.dbus__dat_w);
            if (write && watch_b != 0 && address >= watch_b && address < watch_b + 4 * WATCH_B)
                $display("B %0d %0d %h", cycle, (address - watch_b) / 4, dut.soc.ram.dbus__dat_w);
            restarted <= dut.soc.restart;
            if (dut.soc.restart && !restarted) $display("W %0d", cycle);
            if (updates >= limit) begin
                left <= left - 1;
                if (left == 0) $finish;
            end
        end
    end

    console #(.DIVISOR(CONSOLE_DIVISOR), .KEY_BITS(2001)) console (
        .clk(clk), .rst(rst), .now(cycle), .tx(console_tx), .rx(console_rx)
    );
endmodule
