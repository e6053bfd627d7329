// `harness.sv` with one cycle of its clock for each change of `step`, for a simulator in which
// inputs that change together with `step` settle before the edge (Verilator). Outputs are those of
// the cycle that ended, as they were before its edge.

module stepped #(
    parameter WORD = 32,
    parameter LANES = 1
) (
    input wire step,
    input wire rst,
    input wire [WORD:0] in_payload,
    input wire in_valid,
    output reg in_ready,
    output reg [WORD:0] out_payload,
    output reg out_valid,
    input wire out_ready,
    input wire [9:0] bus_addr,
    input wire [WORD-1:0] bus_data,
    input wire bus_stb,
    output reg bus_ack,
    input wire restart,
    output reg [1:0] flags,
    output reg [LANES-1:0] w_en,
    output reg [10*LANES-1:0] w_addr,
    output reg [WORD*LANES-1:0] w_data
);
    reg last = 0;
    wire clk = step ^ last;
    wire ready, valid, ack;
    wire [1:0] raised;
    wire [WORD:0] payload;
    wire [LANES-1:0] en;
    wire [10*LANES-1:0] addr;
    wire [WORD*LANES-1:0] data;
    harness #(.WORD(WORD), .LANES(LANES)) bench (
        .clk(clk), .rst(rst),
        .in_payload(in_payload), .in_valid(in_valid), .in_ready(ready),
        .out_payload(payload), .out_valid(valid), .out_ready(out_ready),
        .bus_addr(bus_addr), .bus_data(bus_data), .bus_stb(bus_stb), .bus_ack(ack),
        .restart(restart),
        .flags(raised), .w_en(en), .w_addr(addr), .w_data(data)
    );
    always @(posedge clk) begin
        last <= step;
        {in_ready, out_valid, bus_ack, flags} <= {ready, valid, ack, raised};
        {out_payload, w_en, w_addr, w_data} <= {payload, en, addr, data};
    end
endmodule
