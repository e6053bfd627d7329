// The core with ports that a C++ program can name.

module live #(
    parameter WORD = 32
) (
    input wire clk,
    input wire rst,
    input wire [WORD:0] in_payload,
    input wire in_valid,
    output wire in_ready,
    output wire [WORD:0] out_payload,
    output wire out_valid,
    input wire [9:0] bus_addr,
    input wire [WORD-1:0] bus_data,
    input wire bus_stb,
    output wire bus_ack,
    output wire saturated
);
    core dut (
        .clk(clk), .rst(rst),
        .i__payload(in_payload), .i__valid(in_valid), .i__ready(in_ready),
        .o__payload(out_payload), .o__valid(out_valid), .o__ready(1'b1),
        .bus__addr(bus_addr), .bus__w_data(bus_data), .bus__w_stb(bus_stb),
        .bus__w_ack(bus_ack), .bus__r_data(), .saturated_update(saturated)
    );
endmodule
