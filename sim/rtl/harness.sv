// The core with ports that a bench can name; `w_...` are the lanes' writes of their registers.

module harness #(
    parameter WORD = 32,
    parameter LANES = 1
) (
    input wire clk,
    input wire rst,
    input wire [WORD:0] in_payload,
    input wire in_valid,
    output wire in_ready,
    output wire [WORD:0] out_payload,
    output wire out_valid,
    input wire out_ready,
    input wire [9:0] bus_addr,
    input wire [WORD-1:0] bus_data,
    input wire bus_stb,
    output wire bus_ack,
    input wire restart,
    output wire [1:0] flags,
    output wire [LANES-1:0] w_en,
    output wire [10*LANES-1:0] w_addr,
    output wire [WORD*LANES-1:0] w_data
);
    core dut (
        .clk(clk), .rst(rst),
        .i__payload(in_payload), .i__valid(in_valid), .i__ready(in_ready),
        .o__payload(out_payload), .o__valid(out_valid), .o__ready(out_ready),
        .bus__addr(bus_addr), .bus__w_data(bus_data), .bus__w_stb(bus_stb),
        .bus__w_ack(bus_ack), .bus__r_data(), .restart(restart),
        .saturated_update(flags[0]), .beyond_update(flags[1])
    );
    assign w_en[0] = dut.operands.w_en__0;
    assign w_addr[9:0] = dut.operands.w_addr__0;
    assign w_data[WORD-1:0] = dut.operands.w_data__0;
`ifdef TWO_LANES
    assign w_en[1] = dut.operands.w_en__1;
    assign w_addr[19:10] = dut.operands.w_addr__1;
    assign w_data[2*WORD-1:WORD] = dut.operands.w_data__1;
`endif
endmodule
