// The sentence parser alone: symbols from a file, one every `gap` cycles or later.
// +symbols=FILE: hexadecimal, a byte, 100 for a framing error, 101 for a pause. Prints an event a line.
module hmr3300_parser_bench #(parameter integer GAP = 18) (input clk, input rst);
    reg [7:0] data = 0;
    reg valid = 0, error = 0, pause = 0;
    wire good, is_counts, rejected, invalid;
    wire signed [15:0] v0, v1, v2;
    hmr3300_parser dut (.clk(clk), .rst(rst), .data(data), .valid(valid), .error(error),
        .pause(pause), .line(good), .is_counts(is_counts), .rejected(rejected), .invalid(invalid),
        .values__0(v0), .values__1(v1), .values__2(v2));

    reg [1023:0] name;
    integer file, got, left = 0;
    integer unsigned random = 32'h12345678;
    reg [15:0] symbol;
    reg ended = 0, was = 0;
    initial begin
        if (!$value$plusargs("symbols=%s", name)) $finish;
        file = $fopen(name, "r");
    end
    always @(posedge clk) if (!rst) begin
        valid <= 0;
        error <= 0;
        pause <= 0;
        data <= 8'hAA;  // only in the cycle of valid is it a byte
        random <= random ^ (random << 13) ^ (random >> 17) ^ (random << 5);
        if (left != 0) left <= left - 1;
        else if (ended) $finish;
        else begin
            got = $fscanf(file, "%h", symbol);
            if (got != 1) begin
                ended <= 1;
                left <= 4 * GAP;
            end else begin
                valid <= !symbol[8];
                error <= symbol[8] && !symbol[0];
                pause <= symbol[8] && symbol[0];
                data <= symbol[7:0];
                // Mostly as fast as it may be.
                left <= GAP - 1 + (random[7:6] == 0 ? integer'(random[4:0]) : 0);
            end
        end
        if (error) $display("framing");
        if (rejected) $display("rejected");
        if (invalid) $display("invalid");
        if (good) $display("%s %0d %0d %0d", is_counts ? "counts" : "heading", v0, v1, v2);
    end
endmodule
