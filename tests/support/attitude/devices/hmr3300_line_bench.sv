// The whole reader on a line whose levels come from a file, and a receiver beside it.
// +levels=FILE: lines "level cycles". Prints an event a line, "byte HH" for what was received.
module hmr3300_line_bench (input clk, input rst);
    reg rx = 1;
    reg [31:0] now = 0;
    wire good, is_counts, tx, command_ready;
    wire signed [15:0] v0, v1, v2;
    wire [8:0] events;
    wire [3:0] flags;
    hmr3300_reader dut (.clk(clk), .rst(rst), .rx(rx), .tx(tx), .\time (now), .mode(2'd0),
        .command__valid(1'b0), .command__payload(8'd0), .command__ready(command_ready),
        .line(good), .is_counts(is_counts), .values__0(v0), .values__1(v1), .values__2(v2),
        .flags(flags), .events(events));
    wire [7:0] data;
    wire valid, error;
    hmr3300_receiver beside (.clk(clk), .rst(rst), .rx(rx), .data(data), .valid(valid),
        .error(error));

    reg [1023:0] name;
    integer file, got, cycles, left = 0;
    reg level, ended = 0;
    initial begin
        if (!$value$plusargs("levels=%s", name)) $finish;
        file = $fopen(name, "r");
    end
    always @(posedge clk) if (!rst) begin
        now <= now + 1;
        if (left != 0) left <= left - 1;
        else if (ended) $finish;
        else begin
            got = $fscanf(file, "%d %d", level, cycles);
            if (got != 2) begin
                ended <= 1;
                rx <= 1;
                left <= 2000;
            end else begin
                rx <= level;
                left <= cycles - 1;
            end
        end
        if (valid) $display("byte %h", data);
        if (events[3]) $display("framing");
        if (events[2]) $display("rejected");
        if (events[7]) $display("invalid");
        if (events[0] != (good && !is_counts) || events[1] != (good && is_counts) || !tx
            || events[6:4] != 0) $display("contradiction");
        if (good) $display("%s %0d %0d %0d", is_counts ? "counts" : "heading", v0, v1, v2);
    end
endmodule
