// Reader and device model, by a script.
// +script=FILE: lines "cycle what value": what 0 mode, 1 command (its letter), 2 faults (bits), 3 end.
// Prints "cycle what ..." a line.
module hmr3300_device_bench #(
    parameter integer BIT = 8, LINE = 19_200, STARTUP = 122_880, ANSWER = 150, GLITCH = 1
) (input clk, input rst);
    reg [31:0] now = 0;
    reg [3:0] mode = 0;  // and above its two bits slower
    reg command_valid = 0;
    reg [7:0] command = 0;
    reg [11:0] fault = 0;
    wire rx, tx, command_ready, good, is_counts;
    wire signed [15:0] v0, v1, v2;
    wire [8:0] events;
    wire [3:0] flags;
    wire [31:0] slot;
    hmr3300_device #(.BIT(BIT), .LINE(LINE), .STARTUP(STARTUP), .ANSWER(ANSWER),
        .GLITCH(GLITCH)) device (.clk(clk), .rst(rst), .rx(tx), .tx(rx), .fault(fault),
        .slot(slot));
    hmr3300_reader reader (.clk(clk), .rst(rst), .rx(rx), .tx(tx), .\time (now), .mode(mode[1:0]),
        .slower(mode[3:2]), .command__valid(command_valid), .command__payload({1'b0, command}),
        .command__ready(command_ready), .line(good), .is_counts(is_counts),
        .values__0(v0), .values__1(v1), .values__2(v2), .flags(flags), .events(events));

    reg [1023:0] name;
    integer file, got, due, what, value, k;
    reg [3:0] was = 4'b0001;
    initial begin
        if (!$value$plusargs("script=%s", name)) $finish;
        file = $fopen(name, "r");
        got = $fscanf(file, "%d %d %d", due, what, value);
    end
    always @(posedge clk) if (!rst) begin
        now <= now + 1;
        if (command_ready) command_valid <= 0;
        while (got == 3 && due <= now) begin
            case (what)
                0: mode <= value[3:0];
                1: begin
                    command_valid <= 1;
                    command <= value[7:0];
                end
                2: fault <= value[11:0];
                default: $finish;
            endcase
            got = $fscanf(file, "%d %d %d", due, what, value);
        end
        for (k = 0; k < 9; k = k + 1) if (events[k]) $display("%0d event %0d", now, k);
        if (good) $display("%0d line %0d %0d %0d %0d %0d", now, is_counts, v0, v1, v2, slot);
        if (flags != was) $display("%0d flags %0d", now, flags);
        was <= flags;
    end
endmodule
